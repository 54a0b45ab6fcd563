//! The child process that runs the cases, and the parent process that watches it.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use crate::{FOUND, LONGEST, Way, attempt, judge};

/// The cases to be run: every so many seeds from the first one on.
#[derive(Clone, Copy)]
pub struct Cases {
    pub first: u64,
    pub every: u64,
    pub most: u64,
    pub until: Instant,
}

/// The results of cases.
#[derive(Default)]
pub struct Found {
    pub count: u64,
    pub wrong: Vec<u64>,
}

/// A child that reports nothing for this long hangs.
const HANGS: Duration = Duration::from_secs(600);

/// The environment variable with the task of a child: one of those below, or only fresh cases, or one case by Rapier
/// alone.
const TASK: &str = "FUZZ_TASK";
/// Task: run the known seeds, then fresh ones.
pub const FOUND_FIRST: &str = "found";
/// Task: end the process in the first case.
pub const ABORT: &str = "abort";

/// The prefix of all lines that a child reports.
const SAYS: &str = "fuzz: ";

pub fn is_one() -> bool {
    std::env::var(TASK).is_ok()
}

fn say(word: &str, seed: u64, rest: &str) {
    let rest = rest.replace('\n', " ");
    let mut out = std::io::stdout().lock();
    // An error means that the parent has closed the pipe and needs no report.
    let _ = writeln!(out, "{SAYS}{word} {seed} {rest}");
    let _ = out.flush();
}

/// Runs the cases in a child: reports each seed before its case runs, and the fault of the case, if any.
pub fn run(cases: Cases) {
    let task = std::env::var(TASK).unwrap_or_default();
    if task == "alone" {
        drop(attempt(cases.first, Way::Alone));
        return say("end", cases.first, "");
    }
    if task == ABORT {
        say("at", cases.first, "");
        std::process::abort();
    }
    let fresh = (0..cases.most).map(|number| cases.first + number * cases.every);
    let fresh = fresh.take_while(|_| Instant::now() < cases.until);
    let known = FOUND.into_iter().filter(|_| task == FOUND_FIRST);
    for seed in known.chain(fresh) {
        say("at", seed, "");
        let began = Instant::now();
        if let Some(fault) = judge(seed) {
            say("wrong", seed, &fault);
        }
        if began.elapsed() > LONGEST {
            say("slow", seed, &format!("{:.0?}", began.elapsed()));
        }
    }
    say("end", 0, "");
}

impl Cases {
    /// Deals the cases out to as many processes.
    fn share(self, process: u64, of: u64) -> Self {
        Cases {
            first: self.first + process * self.every,
            every: of * self.every,
            most: self.most.saturating_sub(process).div_ceil(of),
            ..self
        }
    }
}

/// Runs the cases on all processors; only the first one has this task.
pub fn watch_all(cases: Cases, task: &str) -> Found {
    let processes = std::thread::available_parallelism().map_or(1, |it| it.get() as u64);
    let watch = |process| {
        let task = if process == 0 { task } else { "fresh" };
        watch(cases.share(process, processes), task)
    };
    std::thread::scope(|scope| {
        let all: Vec<_> = (0..processes)
            .map(|process| scope.spawn(move || watch(process)))
            .collect();
        let mut found = Found::default();
        for one in all {
            let one = one.join().expect("no panic");
            found.count += one.count;
            found.wrong.extend(one.wrong);
        }
        found
    })
}

/// Runs the cases in children, the first one with this task. After a child dies, another one runs the remaining cases.
pub fn watch(mut cases: Cases, mut task: &str) -> Found {
    let mut found = Found::default();
    loop {
        let Some((seed, end)) = follow(start(cases, task), &mut found) else {
            return found;
        };
        match ends_alone(seed) {
            true => eprintln!("seed {seed}: {end}, and so it does by Rapier alone"),
            false => {
                eprintln!("seed {seed}: {end}");
                found.wrong.push(seed);
            }
        }
        task = "fresh";
        // Known seeds are run before the first one.
        let done = seed.checked_sub(cases.first).map(|it| it / cases.every);
        if let Some(number) = done.filter(|it| *it < cases.most) {
            cases.first = seed + cases.every;
            cases.most -= number + 1;
        }
    }
}

fn start(cases: Cases, task: &str) -> Child {
    let program = std::env::current_exe().expect("this program");
    let left = cases.until.saturating_duration_since(Instant::now());
    Command::new(program)
        .args(["worlds_survive_their_fields", "--exact", "--nocapture"])
        .env(TASK, task)
        .env("FUZZ_SEED", cases.first.to_string())
        .env("FUZZ_EVERY", cases.every.to_string())
        .env("FUZZ_CASES", cases.most.to_string())
        .env("FUZZ_SECONDS", left.as_secs_f64().ceil().to_string())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("a child")
}

/// Reads the reports of a child. If it died or hung, returns the seed of that case, and how it ended.
fn follow(mut child: Child, found: &mut Found) -> Option<(u64, String)> {
    let (sender, lines) = channel();
    let out = child.stdout.take().expect("piped");
    std::thread::spawn(move || pass_on(BufReader::new(out), &sender));
    let mut at = 0;
    let mut ended = false;
    let hangs = loop {
        let line: String = match lines.recv_timeout(HANGS) {
            Ok(line) => line,
            Err(RecvTimeoutError::Disconnected) => break false,
            Err(RecvTimeoutError::Timeout) => break true,
        };
        let Some(said) = line.split_once(SAYS).map(|it| it.1) else {
            if std::env::var("FUZZ_SHOW").is_ok() {
                println!("{line}");
            }
            continue;
        };
        let mut words = said.splitn(3, ' ');
        let word = words.next().unwrap_or_default();
        let seed = words.next().and_then(|it| it.parse().ok()).unwrap_or(at);
        let rest = words.next().unwrap_or_default();
        match word {
            "at" => (at, found.count) = (seed, found.count + 1),
            "end" => ended = true,
            "wrong" => {
                eprintln!("seed {seed}: {rest}");
                found.wrong.push(seed);
            }
            _ => eprintln!("seed {seed}: {word} {rest}"),
        }
    };
    if hangs {
        let _ = child.kill();
    }
    let status = child.wait().expect("a child");
    let how = match hangs {
        true => "hangs".to_owned(),
        false => status.to_string(),
    };
    (!ended).then_some((at, how))
}

fn pass_on(out: impl BufRead, sender: &Sender<String>) {
    for line in out.lines().map_while(Result::ok) {
        if sender.send(line).is_err() {
            return;
        }
    }
}

/// Whether Rapier alone ends the process, or hangs, in the same world.
fn ends_alone(seed: u64) -> bool {
    let cases = Cases {
        first: seed,
        every: 1,
        most: 1,
        until: Instant::now(),
    };
    follow(start(cases, "alone"), &mut Found::default()).is_some()
}
