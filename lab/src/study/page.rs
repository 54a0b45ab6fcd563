//! The report as one HTML page without external files.

use rapier3d_fields_scene::page::{self, Replay};

use super::Report;

const PAGE: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/style.css");
const CHARTS: &str = include_str!("page/charts.js");

impl Report {
    /// The report as one HTML page, light or dark by the reader's preference, with scenes to replay (see
    /// [`crate::replay`]).
    ///
    /// # Errors
    /// A replay cannot be written as JSON.
    pub fn html(&self, replays: &[Replay]) -> Result<String, serde_json::Error> {
        let mut data = self.json();
        data["replays"] = serde_json::to_value(replays)?;
        let data = page::embedded(&data);
        Ok(page::filled(PAGE, |marker| match marker {
            "SHARED" => Some(page::STYLE),
            "STYLE" => Some(STYLE),
            "REPLAY" => Some(page::SCRIPT),
            "CHARTS" => Some(CHARTS),
            "DATA" => Some(&data),
            _ => None,
        }))
    }
}
