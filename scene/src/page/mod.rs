//! Pages that replay runs in a browser: everything in one file, nothing fetched.
//!
//! A recorder ([`single::Recorder`](crate::single::Recorder) or
//! [`double::Recorder`](crate::double::Recorder)) makes a [`Replay`], and a [`Page`] shows it. Other
//! pages can embed a replay by [`STYLE`], [`SCRIPT`], and [`embedded`] for the data.

mod data;

pub use data::{Arrows, ContactKind, DrawnBody, DrawnPart, DrawnShape, Moment, Replay};

/// The style sheet of replays and of the page around them, with a light and a dark theme.
pub const STYLE: &str = include_str!("style.css");

/// The script: `replay(data)` returns an element that plays a [`Replay`]. It declares `make`, which
/// makes elements, and `switchTheme`, which switches between the light and the dark theme.
pub const SCRIPT: &str = concat!(
    include_str!("make.js"),
    include_str!("decode.js"),
    include_str!("camera.js"),
    include_str!("paint.js"),
    include_str!("replay.js"),
);

const PAGE: &str = include_str!("page.html");

/// A page with one replay.
#[derive(Clone, Debug)]
pub struct Page {
    /// The title of the page, and its heading.
    pub title: String,
    /// A line below the replay, such as the numbers of bodies and steps.
    pub facts: String,
    /// The replay; its description stands below the heading.
    pub replay: Replay,
}

impl Page {
    /// The page as HTML. All texts are escaped.
    ///
    /// # Errors
    /// The replay cannot be written as JSON.
    pub fn html(&self) -> Result<String, serde_json::Error> {
        let data = serde_json::json!({
            "title": self.title, "facts": self.facts, "replay": serde_json::to_value(&self.replay)?,
        });
        let data = embedded(&data);
        let title = escaped(&self.title);
        Ok(filled(PAGE, |marker| match marker {
            "TITLE" => Some(&title),
            "STYLE" => Some(STYLE),
            "SCRIPT" => Some(SCRIPT),
            "DATA" => Some(&data),
            _ => None,
        }))
    }
}

/// The template with each marker `/*NAME*/` replaced by the text of that name, if there is one.
/// Inserted texts may contain markers, which are not replaced.
pub fn filled<'a>(template: &str, text: impl Fn(&str) -> Option<&'a str>) -> String {
    let mut page = String::new();
    let mut pieces = template.split("/*");
    page.push_str(pieces.next().unwrap_or_default());
    for piece in pieces {
        let marker = piece.split_once("*/");
        match marker.and_then(|(name, rest)| Some((text(name)?, rest))) {
            Some((text, rest)) => {
                page.push_str(text);
                page.push_str(rest);
            }
            None => {
                page.push_str("/*");
                page.push_str(piece);
            }
        }
    }
    page
}

/// JSON for a script element, with `<` escaped so that no string in it can end the element.
pub fn embedded(data: &serde_json::Value) -> String {
    // In JSON, `<` occurs in strings only, where the escape means the same.
    data.to_string().replace('<', "\\u003c")
}

/// A text with the special characters of HTML escaped.
fn escaped(text: &str) -> String {
    let mut escaped = String::new();
    for letter in text.chars() {
        match letter {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            _ => escaped.push(letter),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markers_in_inserted_texts_are_not_replaced() {
        let text = |marker: &str| match marker {
            "A" => Some("/*B*/"),
            "B" => Some("b"),
            _ => None,
        };
        let page = filled("<i>/*A*/ /*B*/</i> /* no marker */ a /* b", text);
        assert_eq!(page, "<i>/*B*/ b</i> /* no marker */ a /* b");
    }

    #[test]
    fn hostile_texts_are_harmless() {
        let hostile = "</script><script>alert(1)</script><!--\"'&\u{2028}/*DATA*/";
        let page = Page {
            title: hostile.to_owned(),
            facts: hostile.to_owned(),
            replay: Replay {
                name: hostile.to_owned(),
                description: hostile.to_owned(),
                ..Replay::default()
            },
        };
        let html = page.html().expect("a page");
        assert!(!html.contains("alert(1)</script>") && !html.contains("<!--"));
        let count = |what: &str| html.matches(what).count();
        assert_eq!((count("<script"), count("</script")), (2, 2));
        let data = html.split_once(r#"id="data">"#).expect("data").1;
        let data = data.split_once("</script>").expect("an end").0;
        let data: serde_json::Value = serde_json::from_str(data).expect("JSON");
        assert_eq!(data["title"], hostile);
        assert_eq!(data["replay"]["description"], hostile);
    }
}
