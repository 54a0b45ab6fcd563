//! Command lines of the form `--name value`.

use std::fmt::Display;
use std::str::FromStr;

use super::AnyError;

/// The arguments of this run.
pub struct Args(Vec<(String, String)>);

impl Args {
    /// Reads the command line, in which only the options in `known` may occur. For `--help`,
    /// prints `usage` and ends the program.
    pub fn read(usage: &str, known: &[&str]) -> Result<Self, AnyError> {
        let (args, words) = Self::with_words(usage, known)?;
        match words.first() {
            Some(word) => Err(format!("what is `{word}`?\n{usage}").into()),
            None => Ok(args),
        }
    }

    /// Like [`Args::read`], and returns the words that are no options.
    fn with_words(usage: &str, known: &[&str]) -> Result<(Self, Vec<String>), AnyError> {
        let (mut pairs, mut others) = (Vec::new(), Vec::new());
        let mut words = std::env::args().skip(1);
        while let Some(word) = words.next() {
            if matches!(word.as_str(), "-h" | "--help") {
                println!("{usage}");
                std::process::exit(0);
            }
            let Some(name) = word.strip_prefix("--") else {
                others.push(word);
                continue;
            };
            if !known.contains(&name) {
                return Err(format!("what is `{word}`?\n{usage}").into());
            }
            let value = words
                .next()
                .ok_or_else(|| format!("{word} needs a value\n{usage}"))?;
            pairs.push((name.to_owned(), value));
        }
        Ok((Self(pairs), others))
    }

    /// The value of an option, the last one if it is given twice, or `default` if it is not given.
    pub fn get<T: FromStr<Err: Display>>(&self, name: &str, default: T) -> Result<T, AnyError> {
        let Some((_, value)) = self.0.iter().rfind(|(given, _)| given == name) else {
            return Ok(default);
        };
        value
            .parse()
            .map_err(|error| format!("--{name} {value}: {error}").into())
    }

    /// The number of steps, which must not be zero.
    pub fn steps(&self, default: usize) -> Result<usize, AnyError> {
        match self.get("steps", default)? {
            0 => Err("--steps 0: there is nothing to run".into()),
            steps => Ok(steps),
        }
    }
}
