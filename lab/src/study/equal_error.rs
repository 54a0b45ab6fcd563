//! The costs of methods at equal error, as a Markdown table.

use super::{Method, Report, Scene, Verdict, compare};

/// The first lines of the table.
const HEAD: &str = "| scene | error | `add_force` | half kicks by hand | `KickDriftKick` | fastest scheme |\n\
                    |---|---|---|---|---|---|\n";

impl Report {
    /// A line for each of the scenes `names`, or for all if none is named, in one precision: the costs of methods at
    /// the error of the scene's first view, µs per unit of simulated time. Scenes without runs are left out.
    pub fn equal_error_table(&self, precision: u32, names: &[&str]) -> String {
        let wanted = |scene: &&Scene| names.is_empty() || names.contains(&scene.name.as_str());
        let scenes = self.scenes.iter().filter(wanted);
        let lines = scenes.filter_map(|scene| self.line(precision, scene));
        HEAD.to_owned() + &lines.collect::<String>()
    }

    fn line(&self, precision: u32, scene: &Scene) -> Option<String> {
        let (metric, target) = *scene.views.first()?;
        let runs: Vec<_> = self.of(precision).cloned().collect();
        let verdict = compare(&runs, &scene.name, metric, target);
        let tried = |method: Method| {
            let mut runs = runs.iter().filter(|run| run.case == scene.name);
            runs.any(|run| run.method == method)
        };
        if !tried(Method::KickDriftKick) {
            return None;
        }
        let methods = [Method::AddForce, Method::KicksByHand, Method::KickDriftKick];
        let costs = methods.map(|method| cost(&verdict, method));
        let fastest = verdict.best(true);
        let fastest = fastest.map_or("–".to_owned(), |(method, cost)| {
            format!("{} `{}`", rounded(cost), method.name())
        });
        let (name, unit) = (&scene.name, &scene.time_unit);
        let error = format!("{} {target:.0e}", metric.name());
        Some(format!(
            "| {name} ({unit}) | {error} | {} | {fastest} |\n",
            costs.join(" | ")
        ))
    }
}

fn cost(verdict: &Verdict, method: Method) -> String {
    verdict.cost(method).map_or("–".to_owned(), rounded)
}

/// A cost to two significant digits.
fn rounded(cost: f64) -> String {
    let tens = cost.log10().floor() as i32 - 1;
    match u32::try_from(tens) {
        Ok(tens) => {
            let unit = 10_f64.powi(tens as i32);
            format!("{}", (cost / unit).round() * unit)
        }
        Err(_) => format!("{cost:.0$}", tens.unsigned_abs() as usize),
    }
}

#[cfg(test)]
mod tests {
    use super::rounded;

    #[test]
    fn costs_have_two_digits() {
        let told = [1234.0, 99.6, 12.34, 1.234, 0.01234].map(rounded);
        assert_eq!(told, ["1200", "100", "12", "1.2", "0.012"]);
    }
}
