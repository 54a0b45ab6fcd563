//! The study of schemes: its arithmetic on known numbers, and its cases against theory.

use crate::lab::cases::{
    self, Case, Effort, Filed, Galperin, Impacts, LongGas, Motion, PRECISION, leave_out,
    molecules_from_csv, spring,
};
use rapier3d_fields_lab::study::{
    Ceiling, Job, Machine, Measured, Method, Metric, Outcome, Report, Run, Scene, Shard, Store,
    StudyError, Table, Timing, Work, compare, fit_order, from_csv, time_at_error, to_csv, to_table,
};

use crate::support::{assert_at_most, assert_close, either, scientific};

const DIMER: &str = include_str!("../data/c_trajectories/dimer_bound.csv");

fn halvings(first: f64, count: i32) -> Vec<f64> {
    (0..count).map(|k| first * 0.5_f64.powi(k)).collect()
}

fn run(case: &dyn Case, method: Method, dt: f64) -> Run {
    case.run(method, dt)
        .expect("a method and a step of the case")
}

/// A run of an invented case, with a given error and cost.
fn made_up(method: Method, dt: f64, error: f64, cost: f64) -> Run {
    Run {
        case: "made up".to_owned(),
        method,
        precision: PRECISION,
        dt,
        steps: 7,
        simulated: 2.0,
        evaluations: 8,
        warned: 1,
        errors: vec![
            Measured {
                metric: Metric::FinalState,
                value: error,
            },
            Measured {
                metric: Metric::Energy,
                value: error / 3.0,
            },
        ],
        timing: Timing::of(vec![1e-6 * cost; 3].into_iter().map(|x| 2.0 * x).collect()),
    }
}

#[test]
fn the_order_of_a_power_law_is_its_exponent() {
    for order in [1.0, 2.0, 4.0] {
        let steps = halvings(0.1, 6);
        let points: Vec<_> = steps.iter().map(|dt| (*dt, 3.0 * dt.powf(order))).collect();
        let fit = fit_order(&points).expect("enough points");
        assert_close(fit.order, order, 1e-12, "order");
        assert_eq!(fit.floor, None);
    }
}

#[test]
fn errors_that_do_not_show_the_order_are_left_out() {
    // Far off, then order 2, then rounding at 1e-6.
    let step = halvings(1.0, 14);
    let error = |dt: &f64| if *dt > 0.3 { 0.9 } else { (dt * dt).max(1e-6) };
    let points: Vec<_> = step.iter().map(|dt| (*dt, error(dt))).collect();
    let fit = fit_order(&points).expect("enough points");
    assert_close(fit.order, 2.0, 1e-12, "order");
    assert_eq!(fit.floor, Some(1e-6));
    assert_eq!(
        fit.points, 7,
        "0.25 to 0.004, whose error is 15 times the floor"
    );

    assert_eq!(fit_order(&[]), None);
    assert_eq!(fit_order(&[(0.1, 1e-3)]), None);
    assert_eq!(
        fit_order(&[(0.2, 2.0), (0.1, f64::INFINITY), (0.05, 1e-3)]),
        None
    );
    let flat = [(0.4, 0.1), (0.2, 0.1), (0.1, 0.1)];
    assert_eq!(
        fit_order(&flat),
        None,
        "errors that do not fall have no order"
    );
}

#[test]
fn time_at_an_error_is_interpolated_between_runs() {
    let points = [(1.0, 1e-1), (10.0, 1e-2), (100.0, 1e-3)];
    let time = |error| time_at_error(&points, error);
    assert_close(time(1e-2).unwrap(), 10.0, 1e-9, "a run");
    assert_close(
        time(10.0_f64.powf(-2.5)).unwrap(),
        1000.0_f64.sqrt(),
        1e-9,
        "between",
    );
    assert_eq!(time(0.5), Some(1.0), "the cheapest run does");
    assert_eq!(time(1e-4), None, "never reached");
}

#[test]
fn a_method_that_is_slower_at_every_error_is_dominated() {
    let curve = |method, factor: f64| {
        let steps = halvings(0.5, 5);
        let of = move |dt: f64| made_up(method, dt, 0.5 * dt, factor / dt);
        steps.into_iter().map(of)
    };
    let mut runs: Vec<Run> = curve(Method::KickDriftKick, 1.0).collect();
    runs.extend(curve(Method::Kick, 3.0));
    runs.push(made_up(Method::ExternalForce, 0.5, 0.9, 1.0));
    runs.push(made_up(Method::AddForce, 0.5, f64::INFINITY, 0.1));
    let verdict = compare(&runs, "made up", Metric::FinalState, 0.05);
    let reached: Vec<Method> = verdict.reached.iter().map(|(method, _)| *method).collect();
    assert_eq!(reached, [Method::KickDriftKick, Method::Kick]);
    assert_close(
        verdict.reached[1].1 / verdict.reached[0].1,
        3.0,
        1e-9,
        "ratio",
    );
    assert_eq!(verdict.missed, [Method::ExternalForce, Method::AddForce]);
    assert!(
        verdict
            .dominated
            .contains(&(Method::Kick, Method::KickDriftKick))
    );
    assert!(
        !verdict
            .dominated
            .iter()
            .any(|(method, _)| *method == Method::ExternalForce)
    );
    let sentence = verdict.to_string();
    assert!(
        sentence.starts_with("made up: for an error (final state) of 5e-2 use KickDriftKick"),
        "{sentence}"
    );
    assert!(
        sentence.contains("it is 3.0 × cheaper than Kick"),
        "{sentence}"
    );
}

#[test]
fn times_are_summed_up_by_quartiles() {
    let timing = Timing::of(vec![5.0, 1.0, 2.0, 4.0, 3.0]);
    assert_eq!((timing.repeats, timing.min, timing.median), (5, 1.0, 3.0));
    assert_eq!((timing.lower_quartile, timing.upper_quartile), (2.0, 4.0));
    assert_eq!(Timing::of(vec![1.0, 2.0]).median, 1.5);
    assert_eq!(Timing::of(Vec::new()).median, 0.0);
}

#[test]
fn runs_are_the_same_after_writing_and_reading() {
    let mut runs: Vec<Run> = [0.1, 1.0 / 3.0]
        .map(|dt| made_up(Method::Kick, dt, dt / 7.0, dt))
        .to_vec();
    runs.push(made_up(Method::AddForce, 0.1, f64::INFINITY, 1.0));
    runs.push(run(&spring(), Method::KickDriftKick, 1.0 / 16.0));
    let text = to_csv(&runs);
    assert_eq!(from_csv(&text).expect("what was written"), runs);
    let energy = Metric::Energy.definition();
    assert!(text.contains(energy), "the file says what its errors are");
    assert!(runs[2].diverged() && !runs[0].diverged());
    assert!(to_table(&runs).contains("diverged"));
}

#[test]
fn a_file_that_cannot_be_read_says_where() {
    let text = to_csv(&[made_up(Method::Kick, 0.1, 0.2, 0.3)]);
    let message = |text: &str| from_csv(text).expect_err("not readable").to_string();
    assert!(message(&text.replace("Kick", "Lick")).contains("`Lick` is no method"));
    assert!(message(&text.replace("energy,", "energy,x")).contains("column `error`"));
    assert!(message(&text.replace("evaluations", "evils")).contains("column `evaluations`"));
    assert!(message(&text.replace("Kick,", "Kick,1,")).contains("cells"));
    assert!(message("# nothing\n").contains("line of names"));
    assert!(Table::parse("a,b\n1,2\n").is_ok());
}

#[test]
fn methods_and_steps_that_do_not_fit_a_case_are_errors() {
    let error = spring().run(Method::PaperLaw, 0.125).unwrap_err();
    assert_eq!(
        error.to_string(),
        "case `spring` cannot be moved by fields (paper's law)"
    );
    for dt in [0.0, -0.125, 0.3, 100.0, f64::NAN] {
        let error = spring().run(Method::Kick, dt).unwrap_err();
        assert!(
            matches!(error, StudyError::TimeStep { .. }),
            "dt {dt}: {error}"
        );
    }
    let error = molecules_from_csv("dimer", "", (DIMER, 2, 51))
        .err()
        .expect("too few");
    assert_eq!(error.to_string(), "the table has no sample 51");
}

/// Order of the error of the final state over three halvings of the step, from `steps_per_period` on.
fn spring_order(method: Method, steps_per_period: f64) -> f64 {
    let runs = halvings(1.0 / steps_per_period, 4)
        .into_iter()
        .map(|dt| run(&spring(), method, dt));
    let errors: Vec<f64> = runs
        .map(|run| run.error(Metric::FinalState).expect("its metric"))
        .collect();
    let order = (errors[0] / errors[3]).log2() / 3.0;
    let (name, errors) = (method.name(), scientific(&errors));
    println!("{name}: errors {errors}, order {order:.3}");
    order
}

#[test]
fn the_spring_shows_the_order_of_each_scheme() {
    assert_close(
        spring_order(Method::KickDriftKick, 32.0),
        2.0,
        0.05,
        "KickDriftKick",
    );
    assert_close(spring_order(Method::Kick, 256.0), 1.0, 0.15, "Kick");
    // Their amplitude grows by e^(3/16 dt ω² t), which is of first order only where it is small.
    assert_close(
        spring_order(Method::ExternalForce, 1024.0),
        1.0,
        0.12,
        "ExternalForce",
    );
    assert_close(
        spring_order(Method::AddForce, 1024.0),
        1.0,
        0.12,
        "AddForceLoop",
    );
}

#[test]
fn only_the_kicks_keep_the_energy_of_the_spring() {
    // Theory: under a force given to Rapier, with 4 solver iterations, the energy grows by the factor 1 + 3 h²/8 per
    // step, h = dt ω.
    let dt: f64 = 1.0 / 64.0;
    let energy = |method| {
        run(&spring(), method, dt)
            .error(Metric::Energy)
            .expect("its metric")
    };
    let h = dt * std::f64::consts::TAU;
    let growth = (1.0 + 0.375 * h * h).powf(10.25 / dt) - 1.0;
    let found = energy(Method::AddForce);
    assert_close(found / growth, 1.0, 0.05, "growth");
    assert_close(
        energy(Method::ExternalForce) / found,
        1.0,
        1e-4,
        "the same channel",
    );
    assert!(energy(Method::KickDriftKick) < 3e-3 && energy(Method::Kick) < 0.06);
}

#[test]
fn forces_are_evaluated_once_a_step() {
    let dimer = molecules_from_csv("dimer", "", (DIMER, 2, 1)).expect("the file");
    let once = [
        Method::KickDriftKick,
        Method::Kick,
        Method::ExternalForce,
        Method::AddForce,
        Method::AddForceOnce,
        Method::KicksByHand,
    ];
    for case in [&spring() as &dyn Case, &dimer] {
        let dt = case.about().longest;
        for method in once {
            let [coarse, fine] = [dt, 0.5 * dt].map(|dt| run(case, method, dt));
            let place = format!("{}, {}", case.about().name, method.name());
            let more = fine.evaluations - coarse.evaluations;
            // Once more where a force first changes much, to see whether it jumps.
            let off = more.abs_diff(fine.steps - coarse.steps);
            assert!(off <= 1, "{place}: {more}");
            // The first step also checks how stiff new bodies are.
            assert!(coarse.evaluations - coarse.steps < 40, "{place}");
        }
    }
}

#[test]
fn the_dimer_follows_its_reference() {
    let dimer = molecules_from_csv("dimer", "", (DIMER, 2, 5)).expect("the file");
    let duration = dimer.about().duration;
    assert_close(duration, 0.2, 1e-15, "duration");
    let error = |method| {
        let run = run(&dimer, method, duration / 100.0);
        run.error(Metric::AtomPosition).expect("its metric")
    };
    let (ours, plain) = (error(Method::KickDriftKick), error(Method::AddForce));
    println!("dimer, 2 fs, after 0.2 ps: {ours:.2e} Å, loop {plain:.2e} Å");
    assert!(ours < 1e-3 && plain > 10.0 * ours);
}

#[test]
fn discrete_impacts_are_answered_half_a_step_late() {
    let impacts = Impacts::reference();
    assert_eq!(impacts.pairs.len(), 82);
    let dt = 1.0 / 32.0;
    let ours = run(&impacts, Method::FieldsDiscrete, dt);
    let error = |metric| ours.error(metric).expect("its metric");
    assert_close(error(Metric::ContactTime) / dt, 0.5, 0.15, "delay");
    assert!(error(Metric::Velocity) < 0.5 * dt && error(Metric::Velocity95) < 2.0 * dt);
    let paper = run(&impacts, Method::PaperLaw, dt);
    assert!(
        paper.error(Metric::Velocity) > Some(0.3),
        "{:?}",
        paper.errors
    );
}

/// Each reference is known in two ways: by a formula or an external table, and by integrating the equations of motion.
#[test]
#[cfg(feature = "f64")]
fn the_equations_of_motion_lead_to_the_references() {
    for motion in Motion::all() {
        let (off, change) = motion.doubt();
        println!(
            "{}: {off:.1e}, by the last halving {change:.1e}",
            motion.name()
        );
        // At an eccentricity of 0.99 the steps of the check are too long to tell much.
        assert_at_most(off, 1e-7 + 2.0 * change, motion.name());
    }
}

/// Loops by hand and fields apply the same forces: with the same kicks they give the same motion.
#[test]
fn loops_by_hand_and_fields_give_the_same_motion() {
    for motion in Motion::all() {
        let about = motion.about();
        // Loops by hand read the velocities that the last step left.
        if about.name == "drag" || about.name == "helix" || about.name == "E × B" {
            continue;
        }
        let dt = about.time_steps()[about.halvings - 1];
        let error = |method| run(&motion, method, dt).errors[0].value;
        let (ours, theirs) = (error(Method::KickDriftKickOnce), error(Method::KicksByHand));
        println!("{}: {ours:.2e}, by hand {theirs:.2e}", about.name);
        // Rapier turns bodies to first order; fields turn them exactly.
        assert_at_most(ours, 1.2 * theirs + either(2e-3, 1e-9), &about.name);
    }
}

#[test]
fn every_case_is_moved_by_each_of_its_methods() {
    all_methods(|case| case.is_quick());
}

/// `cargo test --release --test it long_cases -- --ignored`: a minute, most of it for their references.
#[test]
#[ignore = "long"]
fn long_cases_are_moved_by_each_of_their_methods() {
    all_methods(|case| !case.is_quick());
}

fn all_methods(wanted: impl Fn(&dyn Case) -> bool) {
    for case in cases::all().into_iter().filter(|it| wanted(it.as_ref())) {
        let about = case.about();
        assert!(!about.name.contains(','), "tables are cut at commas");
        for method in case.methods() {
            let run = run(case.as_ref(), *method, about.longest);
            assert_eq!(run.errors[0].metric, about.views[0].0, "{}", about.name);
            assert!(run.errors.iter().all(|it| !it.value.is_nan()));
        }
    }
}

fn error(run: &Run, metric: Metric) -> f64 {
    run.error(metric).expect("its metric")
}

#[test]
fn swept_fields_count_the_digits_of_pi() {
    let swept = run(&Galperin, Method::FieldsSwept, 0.125);
    assert_eq!(error(&swept, Metric::Count), 0.0);
    assert_at_most(
        error(&swept, Metric::Velocity),
        either(1e-4, 1e-9),
        "velocities",
    );
    let rapier = run(&Galperin, Method::Rapier, 0.125);
    assert!(error(&rapier, Metric::Count) > 0.3, "{:?}", rapier.errors);
}

#[test]
fn near_misses_are_not_answered() {
    let impacts = Impacts::reference();
    assert_eq!(impacts.misses.len(), 18);
    let swept = run(&impacts, Method::FieldsSwept, 0.125);
    assert_eq!(error(&swept, Metric::Invented), 0.0);
    assert_eq!(error(&swept, Metric::Missed), 0.0);
}

/// 99.9 % of samples of 800 speeds are within 0.07; the statistical error of 1,940 collisions is 0.023.
#[test]
fn a_long_gas_agrees_with_statistical_mechanics() {
    let gas = LongGas::dense();
    let swept = run(&gas, Method::FieldsSwept, 1.0 / 60.0);
    println!("{:?}", swept.errors);
    assert_at_most(error(&swept, Metric::Speeds), 0.07, "speeds");
    assert_at_most(error(&swept, Metric::CollisionRate), 0.07, "collisions");
    assert_at_most(error(&swept, Metric::Energy), either(2e-4, 1e-11), "energy");
}

#[test]
fn a_scene_of_a_file_converges_to_itself() {
    let text = include_str!("../../examples/scenes/planet.json");
    // A user's own force is applied by Rapier, to first order.
    let without_force = text.replace(r#""force": [0.0, 0.0, 2.0],"#, "");
    assert_ne!(text, without_force);
    let text = without_force.as_str();
    let planet = Filed::new("planet", text, Some(1.0)).expect("a scene");
    let dt = planet.about().longest;
    assert!(planet.doubt() < 1e-5, "{}", planet.doubt());
    let [coarse, fine] = [dt, 0.25 * dt].map(|dt| {
        let run = run(&planet, Method::KickDriftKick, dt);
        error(&run, Metric::OwnPosition)
    });
    assert!(
        coarse < 1e-2 && fine < either(0.5, 0.1) * coarse,
        "{coarse:e}, {fine:e}"
    );
    for (name, text, duration) in [("a, b", text, 1.0), ("a", "{}", 1.0), ("a", text, 0.0)] {
        assert!(Filed::new(name, text, Some(duration)).is_err());
    }
}

/// Doubles 7 until 112 is too many, then bisects what is between.
#[test]
fn the_most_bodies_are_found_by_doubling_and_bisection() {
    let find = |frame: f64, most: usize| {
        let mut tried = Vec::new();
        let found = Ceiling::find((7, most), frame, |count| {
            tried.push(count);
            Some(count as f64)
        });
        (found, tried)
    };
    let (found, tried) = find(80.0, 1000);
    assert_eq!(tried, [7, 14, 28, 56, 112, 84, 70, 77]);
    assert_eq!(found, Some(((77, 77.0), Some((84, 84.0)))));
    assert_eq!(find(80.0, 50).0, Some(((50, 50.0), None)));
    assert_eq!(find(3.0, 50).0, None);
}

#[test]
fn features_that_a_scene_does_not_need_change_nothing() {
    let table = leave_out(&spring(), 3).expect("a case of the fields");
    assert!(table.len() > 3);
    for it in &table {
        println!("{it:?}");
        assert!(it.step > 0.0 && it.ratios[0] <= it.ratios[2]);
        // Rounding, where samples of the volume replace the centre.
        assert_at_most(it.change, either(1e-4, 1e-12), &it.switch);
    }
}

fn job(case: &str) -> Job {
    Job {
        precision: PRECISION,
        work: Work::Case(case.to_owned()),
    }
}

#[test]
fn a_study_in_parts_merges_into_the_whole() {
    let folder = std::env::temp_dir().join(format!("study-{}-{PRECISION}", std::process::id()));
    let jobs: Vec<Job> = ["a", "b, c", "d"].map(job).to_vec();
    let store = Store::new(&folder, "quick");
    let outcome = |job: &Job| Outcome {
        runs: vec![Run {
            case: job.to_string().replace(',', ""),
            ..made_up(Method::Kick, 0.1, 0.2, 0.3)
        }],
        ..Outcome::default()
    };
    let halves = ["1/2", "2/2"].map(|it| it.parse::<Shard>().expect("a part").share(jobs.clone()));
    assert_eq!(halves.concat().len(), jobs.len());
    for job in &halves[0] {
        store
            .save(job, &outcome(job))
            .expect("a folder to write in");
    }
    let missing = store
        .merge(&jobs)
        .expect("readable")
        .expect_err("half of it");
    assert_eq!(missing, halves[1]);
    for job in &halves[1] {
        store
            .save(job, &outcome(job))
            .expect("a folder to write in");
    }
    let merged = store.merge(&jobs).expect("readable").expect("all of it");
    let all = jobs.iter().flat_map(|job| outcome(job).runs);
    assert_eq!(merged.runs, all.collect::<Vec<_>>());
    // A store of another plan does not see these outcomes, and no half-written file stays.
    let other = Store::new(&folder, "full");
    assert_eq!(other.load(&jobs[0]).expect("readable"), None);
    let files = std::fs::read_dir(&folder).expect("the folder").count();
    assert_eq!(files, 3);
    std::fs::remove_dir_all(&folder).expect("its own folder");
    for bad in ["", "1", "0/2", "3/2", "a/b", "1/0"] {
        assert!(bad.parse::<Shard>().is_err(), "{bad}");
    }
}

#[test]
fn the_page_has_the_numbers_of_the_table() {
    let case = spring();
    let plan =
        [Method::KickDriftKick, Method::AddForce].map(|it| [(it, 1.0 / 16.0), (it, 1.0 / 64.0)]);
    let effort = Effort {
        rounds: 2,
        seconds: 0.0,
        most: 2,
    };
    let about = case.about();
    let runs = cases::study(&case, &plan.concat(), effort, || ()).expect("methods of the case");
    assert!(runs.iter().all(|run| run.timing.repeats == 2));
    let report = Report {
        machine: Machine::here(),
        scenes: vec![Scene {
            description: "ends in </script>".to_owned(),
            ..about.scene()
        }],
        runs,
        cells: Vec::new(),
        ablations: Vec::new(),
        ceilings: Vec::new(),
    };
    let page = report.html(&[]).expect("a page");
    let start = page.find("id=\"data\">").expect("the data") + "id=\"data\">".len();
    let end = start + page[start..].find("</script>").expect("its end");
    let data: serde_json::Value = serde_json::from_str(&page[start..end]).expect("JSON");
    assert_eq!(data["scenes"][0]["description"], "ends in </script>");
    let table = from_csv(&report.csv()).expect("what was written");
    assert_eq!(table, report.runs);
    let shown = data["runs"].as_array().expect("runs");
    assert_eq!(shown.len(), table.len());
    for (shown, run) in shown.iter().zip(&table) {
        assert_eq!(shown["method"], run.method.name());
        assert_eq!(shown["seconds"]["median"].as_f64(), Some(run.timing.median));
        assert_eq!(shown["cost"].as_f64(), Some(run.cost()));
        for error in &run.errors {
            assert_eq!(
                shown["errors"][error.metric.name()].as_f64(),
                Some(error.value)
            );
        }
    }
    // The page loads nothing from elsewhere.
    for word in ["http://", "https://", "src=", "@import", "url("] {
        let found = page.replace("http://www.w3.org/2000/svg", "");
        assert!(!found.contains(word), "the page says {word}");
    }
    assert!(report.advice().iter().all(|it| it.case == "spring"));
}
