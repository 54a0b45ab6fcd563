//! JSON in indented lines; short lists and objects stand on one line.

/// The width of a line; lists and objects that exceed it are broken into lines.
const WIDTH: usize = 96;

/// The positions of each opening bracket and of its closing one in a text without spaces, and the
/// depth of nesting.
fn brackets(compact: &str) -> (Vec<(usize, usize)>, usize) {
    let (mut open, mut pairs, mut deepest) = (Vec::new(), Vec::new(), 0);
    let (mut quoted, mut escaped) = (false, false);
    for (place, byte) in compact.bytes().enumerate() {
        if quoted {
            quoted = escaped || byte != b'"';
            escaped = byte == b'\\' && !escaped;
            continue;
        }
        match byte {
            b'"' => quoted = true,
            b'{' | b'[' => {
                open.push(pairs.len());
                pairs.push((place, place));
                deepest = deepest.max(open.len());
            }
            b'}' | b']' => {
                if let Some(pair) = open.pop() {
                    pairs[pair].1 = place;
                }
            }
            _ => {}
        }
    }
    (pairs, deepest)
}

/// The depth of nested brackets.
pub(super) fn depth(compact: &str) -> usize {
    brackets(compact).1
}

/// Breaks a text without spaces into lines.
pub(super) fn print(compact: &str) -> String {
    let (pairs, _) = brackets(compact);
    let mut pairs = pairs.into_iter();
    let mut page = Page::default();
    let (mut quoted, mut escaped) = (false, false);
    for (place, c) in compact.char_indices() {
        if quoted {
            page.text.push(c);
            quoted = escaped || c != '"';
            escaped = c == '\\' && !escaped;
            continue;
        }
        match c {
            '{' | '[' => {
                let end = pairs.next().map_or(place, |(_, end)| end);
                page.open(c, end - place);
            }
            '}' | ']' => page.close(c),
            ',' => page.separate(),
            ':' => page.text.push_str(": "),
            _ => {
                page.text.push(c);
                quoted = c == '"';
            }
        }
    }
    page.text.push('\n');
    page.text
}

#[derive(Default)]
struct Page {
    text: String,
    line: usize,
    /// For each open list or object, whether it is broken into lines.
    broken: Vec<bool>,
}

impl Page {
    fn new_line(&mut self) {
        self.text.push('\n');
        self.line = self.text.len();
        let indent = self.broken.iter().filter(|broken| **broken).count();
        (0..indent).for_each(|_| self.text.push_str("  "));
    }

    /// Opens a list or object; `length` is that of its text without spaces.
    fn open(&mut self, bracket: char, length: usize) {
        // Spaces make it longer by about a fifth.
        let column = self.text.len() - self.line;
        let fits = column + length + length / 5 <= WIDTH;
        let within_one_line = self.broken.last() == Some(&false);
        let broken = !fits && !within_one_line && length > 1;
        self.text.push(bracket);
        self.broken.push(broken);
        if broken {
            self.new_line();
        } else if bracket == '{' && length > 1 {
            self.text.push(' ');
        }
    }

    fn close(&mut self, bracket: char) {
        if self.broken.pop() == Some(true) {
            self.new_line();
        } else if bracket == '}' && !self.text.ends_with('{') {
            self.text.push(' ');
        }
        self.text.push(bracket);
    }

    fn separate(&mut self) {
        self.text.push(',');
        if self.broken.last() == Some(&true) {
            self.new_line();
        } else {
            self.text.push(' ');
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_long_lists_and_objects_are_broken_into_lines() {
        let long = "x".repeat(90);
        let compact =
            format!(r#"{{"a":[1,2],"b":{{}},"c":[],"d":{{"e":"{{\"[,:\\"}},"f":"{long}"}}"#);
        let pretty = print(&compact);
        let lines: Vec<&str> = pretty.lines().collect();
        assert_eq!(lines[0], "{");
        assert_eq!(lines[1], r#"  "a": [1, 2],"#);
        assert_eq!(lines[2], r#"  "b": {},"#);
        assert_eq!(lines[3], r#"  "c": [],"#);
        assert_eq!(lines[4], r#"  "d": { "e": "{\"[,:\\" },"#);
        assert_eq!(lines.len(), 7);
        let value = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
        assert_eq!(value(&pretty), value(&compact));
        assert_eq!(depth(&compact), 2);
    }
}
