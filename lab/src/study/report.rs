//! Runs of many cases, and the advice that follows from them.

use serde::Serialize;

use super::{
    Ablation, Ceiling, Machine, Method, Metric, Run, StabilityCell, Verdict, compare, safe_turn,
    to_csv,
};

/// The description of a case for the reader of a report.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scene {
    /// The name in tables and files.
    pub name: String,
    /// One sentence on the motion and the reference it is compared with.
    pub description: String,
    /// The unit of simulated time.
    pub time_unit: String,
    /// Metrics by which methods are compared, each with the error at which their costs are compared.
    #[serde(skip)]
    pub views: Vec<(Metric, f64)>,
}

/// All runs of a study.
#[derive(Clone, Debug)]
pub struct Report {
    /// The machine on which times were measured.
    pub machine: Machine,
    /// The cases, in the order of the report.
    pub scenes: Vec<Scene>,
    /// The runs.
    pub runs: Vec<Run>,
    /// Cells of the stability map.
    pub cells: Vec<StabilityCell>,
    /// Costs of features that cases do not need.
    pub ablations: Vec<Ablation>,
    /// Numbers of bodies that run in real time.
    pub ceilings: Vec<Ceiling>,
}

/// The method to use for a case, at one error, in one precision.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Advice {
    /// Name of the case.
    pub case: String,
    /// Bits of the numbers.
    pub precision: u32,
    /// The metric of the error.
    pub metric: &'static str,
    /// The error.
    pub target: f64,
    /// The fastest method of this crate, and its cost, µs per unit of simulated time.
    pub ours: Option<(&'static str, f64)>,
    /// The fastest method without this crate.
    pub theirs: Option<(&'static str, f64)>,
    /// The advice as a sentence, with all methods.
    pub sentence: String,
    /// Methods that no other beats at every error.
    pub front: Vec<&'static str>,
}

impl Report {
    /// The verdicts on all cases, for each of their views and each precision of the runs.
    fn verdicts(&self) -> impl Iterator<Item = (u32, Verdict)> {
        let mut precisions: Vec<u32> = self.runs.iter().map(|run| run.precision).collect();
        precisions.sort_unstable();
        precisions.dedup();
        precisions.into_iter().flat_map(move |precision| {
            let own: Vec<Run> = self.of(precision).cloned().collect();
            let views = self.scenes.iter().flat_map(|scene| {
                let views = scene.views.iter();
                views.map(|(metric, target)| (scene.name.clone(), *metric, *target))
            });
            let views: Vec<_> = views.collect();
            let verdicts = views.into_iter().map(move |(case, metric, target)| {
                (precision, compare(&own, &case, metric, target))
            });
            verdicts.filter(|(_, it)| !it.reached.is_empty() || !it.missed.is_empty())
        })
    }

    /// The runs in one precision.
    pub(super) fn of(&self, precision: u32) -> impl Iterator<Item = &Run> {
        self.runs
            .iter()
            .filter(move |run| run.precision == precision)
    }

    /// The advice for each case.
    pub fn advice(&self) -> Vec<Advice> {
        let advice = self.verdicts().map(|(precision, verdict)| {
            let named = |best: Option<(Method, f64)>| best.map(|(it, cost)| (it.name(), cost));
            let beaten = |method: &Method| verdict.dominated.iter().any(|it| it.0 == *method);
            let front = verdict.reached.iter().map(|it| it.0);
            Advice {
                case: verdict.case.clone(),
                precision,
                metric: verdict.metric.name(),
                target: verdict.target,
                ours: named(verdict.best(true)),
                theirs: named(verdict.best(false)),
                sentence: verdict.to_string(),
                front: front.filter(|it| !beaten(it)).map(Method::name).collect(),
            }
        });
        advice.collect()
    }

    /// The cost of a method over that of another, over all views that both reach: the number of these views, and the
    /// smallest, median and largest ratio. `None` if there are no such views.
    pub fn against(
        &self,
        precision: u32,
        method: Method,
        other: Method,
    ) -> Option<(usize, [f64; 3])> {
        let of_precision = self.verdicts().filter(|it| it.0 == precision);
        let mut ratios: Vec<f64> = of_precision
            .filter_map(|(_, it)| Some(it.cost(method)? / it.cost(other)?))
            .collect();
        ratios.sort_unstable_by(f64::total_cmp);
        let middle = ratios.get(ratios.len() / 2)?;
        Some((ratios.len(), [ratios[0], *middle, ratios[ratios.len() - 1]]))
    }

    /// The advice over all cases of a precision, in a few sentences.
    pub fn overall(&self, precision: u32) -> Vec<String> {
        let rivals = [Method::AddForce, Method::AddForceOnce, Method::KicksByHand];
        let sentence = |rival: Method| {
            let (count, [least, median, most]) =
                self.against(precision, Method::KickDriftKick, rival)?;
            Some(format!(
                "f{precision}: KickDriftKick, the default, takes {median:.2} times as long as {} at equal error \
                 ({}).",
                rival.name(),
                match count {
                    1 => "one comparison that both reach".to_owned(),
                    _ => format!(
                        "median of the {count} comparisons that both reach; from {least:.2} to {most:.2}"
                    ),
                }
            ))
        };
        let mut sentences: Vec<String> = rivals.into_iter().filter_map(sentence).collect();
        sentences.extend(self.winners(precision));
        sentences
    }

    /// A sentence on how often each method is the fastest.
    fn winners(&self, precision: u32) -> Option<String> {
        let mut wins: Vec<(Method, usize)> = Vec::new();
        for (_, verdict) in self.verdicts().filter(|it| it.0 == precision) {
            let Some((best, _)) = verdict.reached.first() else {
                continue;
            };
            match wins.iter_mut().find(|it| it.0 == *best) {
                Some(known) => known.1 += 1,
                None => wins.push((*best, 1)),
            }
        }
        wins.sort_by_key(|it| std::cmp::Reverse(it.1));
        let told: Vec<String> = wins
            .iter()
            .map(|(method, count)| format!("{} {count} ×", method.name()))
            .collect();
        (!told.is_empty()).then(|| format!("f{precision}: the fastest is {}.", told.join(", ")))
    }

    /// For each scheme of the stability map, the largest dt·ω up to which it is stable in every kind of scene without
    /// damping.
    pub fn safe_turns(&self) -> Vec<(String, Option<f64>)> {
        let mut schemes: Vec<&String> = Vec::new();
        for cell in &self.cells {
            if !schemes.contains(&&cell.scheme) {
                schemes.push(&cell.scheme);
            }
        }
        let undamped = |cell: &&StabilityCell| cell.damping == "None";
        let of = |scheme: &&String| {
            let cells = self.cells.iter().filter(undamped);
            safe_turn(cells.filter(|cell| cell.scheme == **scheme))
        };
        schemes.iter().map(|it| ((*it).clone(), of(it))).collect()
    }

    /// The runs as a table, with the machine in its first line.
    pub fn csv(&self) -> String {
        format!("# machine: {}\n{}", self.machine.line(), to_csv(&self.runs))
    }

    /// The whole report as JSON.
    pub fn json(&self) -> serde_json::Value {
        let run = |run: &Run| {
            let errors = run.errors.iter().map(|it| {
                let value = it.value.is_finite().then_some(it.value);
                (it.metric.name().to_owned(), serde_json::json!(value))
            });
            serde_json::json!({
                "case": run.case, "method": run.method.name(), "precision": run.precision,
                "dt": run.dt, "steps": run.steps, "simulated": run.simulated,
                "evaluations": run.evaluations, "warned": run.warned,
                "diverged": run.diverged(), "cost": run.cost(),
                "errors": errors.collect::<serde_json::Map<_, _>>(),
                "seconds": {
                    "repeats": run.timing.repeats, "median": run.timing.median,
                    "min": run.timing.min, "q1": run.timing.lower_quartile,
                    "q3": run.timing.upper_quartile,
                },
            })
        };
        let metric = |it: &Metric| {
            let (unit, definition, reason) = (it.unit(), it.definition(), it.reason());
            let about = serde_json::json!({
                "unit": unit, "definition": definition, "reason": reason,
            });
            (it.name().to_owned(), about)
        };
        let measured = |it: &&Metric| self.runs.iter().any(|run| run.error(**it).is_some());
        let metrics = Metric::ALL.iter().filter(measured).map(metric);
        let scene = |scene: &Scene| {
            let views = scene
                .views
                .iter()
                .map(|(it, at)| serde_json::json!([it.name(), at]));
            serde_json::json!({
                "name": scene.name, "description": scene.description,
                "time_unit": scene.time_unit, "views": views.collect::<Vec<_>>(),
            })
        };
        let methods = Method::ALL.map(|it| serde_json::json!([it.name(), it.is_ours()]));
        let overall = [32, 64].into_iter().flat_map(|it| self.overall(it));
        serde_json::json!({
            "machine": self.machine,
            "metrics": metrics.collect::<serde_json::Map<_, _>>(),
            "methods": methods,
            "scenes": self.scenes.iter().map(scene).collect::<Vec<_>>(),
            "overall": overall.collect::<Vec<_>>(),
            "advice": self.advice(),
            "stability": self.cells,
            "legend": StabilityCell::LEGEND,
            "safe": self.safe_turns(),
            "leaves_out": self.ablations,
            "real_time": self.ceilings,
            "runs": self.runs.iter().map(run).collect::<Vec<_>>(),
        })
    }
}
