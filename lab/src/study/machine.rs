//! The machine of a measurement.

use std::process::Command;

use serde::Serialize;

/// The machine and the version of a measurement.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    /// The processor, as it calls itself.
    pub processor: String,
    /// Number of hardware threads. Runs use one.
    pub threads: usize,
    /// Operating system and instruction set.
    pub system: String,
    /// Version of these packages; the minor version is Rapier's.
    pub version: &'static str,
    /// The commit, if the measurement was made in a repository.
    pub commit: String,
}

impl Machine {
    /// The present machine.
    pub fn here() -> Self {
        let processor = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let model = processor.lines().find_map(|line| {
            let (name, value) = line.split_once(':')?;
            (name.trim() == "model name").then(|| value.trim().to_owned())
        });
        let unknown = || "unknown".to_owned();
        Machine {
            processor: model.unwrap_or_else(unknown),
            threads: std::thread::available_parallelism().map_or(1, |it| it.get()),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            version: env!("CARGO_PKG_VERSION"),
            commit: commit().unwrap_or_else(unknown),
        }
    }

    /// The description in one line.
    pub fn line(&self) -> String {
        format!(
            "{}, {} threads of which one was used, {}, version {}, commit {}",
            self.processor, self.threads, self.system, self.version, self.commit
        )
    }
}

fn commit() -> Option<String> {
    let command = Command::new("git")
        .args(["rev-parse", "--short", "HEAD"])
        .output();
    let output = command.ok().filter(|output| output.status.success())?;
    let name = String::from_utf8(output.stdout).ok()?;
    Some(name.trim().to_owned())
}
