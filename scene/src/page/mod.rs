//! Pages that replay runs in a browser: everything in one file, nothing fetched.
//!
//! A recorder ([`single::Recorder`](crate::single::Recorder) or
//! [`double::Recorder`](crate::double::Recorder)) makes a [`Replay`], and a [`Page`] shows it. What
//! a page of one's own needs is here too: [`STYLE`], [`SCRIPT`], and [`embedded`] for the data.

mod data;

pub use data::{Arrows, ContactKind, DrawnBody, DrawnPart, DrawnShape, Moment, Replay};

/// The style sheet, for light and for dark, of replays and of the page around them.
pub const STYLE: &str = include_str!("style.css");

/// The script: `replay(data)` returns an element that plays a [`Replay`]. It declares `make`, which
/// makes elements, and `switchTheme`, which turns light into dark and back.
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
    /// A line below the picture: how many bodies, steps, and the like.
    pub facts: String,
    /// What is replayed; its description stands below the heading.
    pub replay: Replay,
}

impl Page {
    /// The page as HTML. Texts in it may hold anything.
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

/// A template in which each marker `/*NAME*/` is replaced by the text of that name, if it has one.
/// What is put in is not looked at again, so it may hold markers.
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

/// JSON for a script element: whatever its strings hold, the element does not end in them.
pub fn embedded(data: &serde_json::Value) -> String {
    // `<` stands in strings only, where this means the same.
    data.to_string().replace('<', "\\u003c")
}

/// A text for HTML, with what has a meaning there escaped.
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
    fn markers_in_texts_stay_as_they_are() {
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
