//! One page for people: everything in it, nothing fetched.

use super::Report;

const PAGE: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/style.css");
const CHARTS: &str = include_str!("page/charts.js");
const REPLAY: &str = include_str!("page/replay.js");

impl Report {
    /// The report as a page of its own, light or dark as the reader has it, with scenes to replay (see
    /// [`crate::replay`]).
    pub fn html(&self, replays: &[serde_json::Value]) -> String {
        let mut data = self.json();
        data["replays"] = replays.into();
        // Whatever a name holds, the script element does not end in it.
        let data = data.to_string().replace("</", "<\\/");
        PAGE.replace("/*STYLE*/", STYLE)
            .replace("/*CHARTS*/", CHARTS)
            .replace("/*REPLAY*/", REPLAY)
            .replace("/*DATA*/", &data)
    }
}
