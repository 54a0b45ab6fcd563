//! Results on disk, in one file per job of a study, which is complete or does not exist.

use std::fmt;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::{Ablation, Ceiling, Run, StabilityCell, from_csv, to_csv};
use crate::AnyError;

/// A part of a study that is run and stored as a whole, in one precision.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Job {
    /// Bits of the numbers: 32 or 64.
    pub precision: u32,
    /// The content of the job.
    pub work: Work,
}

/// The content of a job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Work {
    /// The runs of the case of that name.
    Case(String),
    /// The stability map of a kind of scene.
    Stability(String),
    /// The costs of features that the case of that name does not need.
    LeaveOut(String),
    /// The number of bodies of a scene that run in real time.
    RealTime(String),
}

/// The results of jobs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Runs of cases.
    pub runs: Vec<Run>,
    /// Cells of the stability map.
    pub cells: Vec<StabilityCell>,
    /// Costs of features that cases do not need.
    pub ablations: Vec<Ablation>,
    /// Numbers of bodies that run in real time.
    pub ceilings: Vec<Ceiling>,
}

impl fmt::Display for Job {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.work {
            Work::Case(name) => write!(f, "{name} in f{}", self.precision),
            Work::Stability(kind) => write!(f, "stability of {kind} in f{}", self.precision),
            Work::LeaveOut(name) => write!(f, "what {name} leaves out in f{}", self.precision),
            Work::RealTime(name) => write!(f, "real time of {name} in f{}", self.precision),
        }
    }
}

/// The i-th of n parts of a list of jobs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// The number of the part, counted from 1.
    pub number: usize,
    /// The number of parts.
    pub of: usize,
}

impl Shard {
    /// All jobs.
    pub const WHOLE: Shard = Shard { number: 1, of: 1 };

    /// The jobs of this part.
    pub fn share(self, jobs: Vec<Job>) -> Vec<Job> {
        let own = |place: &usize| place % self.of == self.number - 1;
        let jobs = jobs.into_iter().enumerate();
        jobs.filter(|(place, _)| own(place))
            .map(|it| it.1)
            .collect()
    }
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/');
        let shard = parts.and_then(|(number, of)| {
            let (number, of) = (number.parse().ok()?, of.parse().ok()?);
            (1..=of).contains(&number).then_some(Shard { number, of })
        });
        shard.ok_or_else(|| format!("`{text}` is no part like 2/8"))
    }
}

/// A folder of results of one plan.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
    plan: String,
}

impl Store {
    /// The results in a folder by `plan`, a description in one line. Results of other plans are ignored.
    pub fn new(folder: impl Into<PathBuf>, plan: impl Into<String>) -> Self {
        Store {
            folder: folder.into(),
            plan: plan.into(),
        }
    }

    fn path(&self, job: &Job) -> PathBuf {
        let name = job.to_string();
        let word = |c: char| if c.is_alphanumeric() { c } else { '_' };
        self.folder
            .join(name.chars().map(word).collect::<String>() + ".txt")
    }

    fn heading(&self) -> String {
        format!("# plan: {}\n", self.plan)
    }

    /// The results of a job, if it is complete.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn load(&self, job: &Job) -> Result<Option<Outcome>, AnyError> {
        let path = self.path(job);
        let text = match fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(format!("{}: {error}", path.display()).into()),
        };
        let Some(rest) = text.strip_prefix(&self.heading()) else {
            return Ok(None);
        };
        let read = || -> Result<Outcome, AnyError> {
            let mut outcome = Outcome::default();
            match job.work {
                Work::Case(_) => outcome.runs = from_csv(rest)?,
                Work::Stability(_) => outcome.cells = serde_json::from_str(rest)?,
                Work::LeaveOut(_) => outcome.ablations = serde_json::from_str(rest)?,
                Work::RealTime(_) => outcome.ceilings = serde_json::from_str(rest)?,
            }
            Ok(outcome)
        };
        let outcome = read().map_err(|error| format!("{}: {error}", path.display()))?;
        Ok(Some(outcome))
    }

    /// Saves the results of a job. If this is interrupted, the file is complete or does not exist.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn save(&self, job: &Job, outcome: &Outcome) -> Result<(), AnyError> {
        let path = self.path(job);
        let unfinished = path.with_extension(format!("{}.part", std::process::id()));
        let body = match job.work {
            Work::Case(_) => to_csv(&outcome.runs),
            Work::Stability(_) => serde_json::to_string(&outcome.cells)?,
            Work::LeaveOut(_) => serde_json::to_string(&outcome.ablations)?,
            Work::RealTime(_) => serde_json::to_string(&outcome.ceilings)?,
        };
        let write = |to: &Path| {
            fs::create_dir_all(&self.folder)?;
            fs::write(to, self.heading() + &body)?;
            fs::rename(to, &path)
        };
        write(&unfinished).map_err(|error| format!("{}: {error}", path.display()).into())
    }

    /// The results of all jobs, or the jobs that are not complete.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn merge(&self, jobs: &[Job]) -> Result<Result<Outcome, Vec<Job>>, AnyError> {
        let (mut all, mut missing) = (Outcome::default(), Vec::new());
        for job in jobs {
            match self.load(job)? {
                Some(found) => {
                    all.runs.extend(found.runs);
                    all.cells.extend(found.cells);
                    all.ablations.extend(found.ablations);
                    all.ceilings.extend(found.ceilings);
                }
                None => missing.push(job.clone()),
            }
        }
        Ok(if missing.is_empty() {
            Ok(all)
        } else {
            Err(missing)
        })
    }
}
