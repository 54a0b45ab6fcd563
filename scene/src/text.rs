//! JSON texts with comments, and the line and column of a path in them.

/// The text with blanks in place of comments (`// …` and `/* … */`), so that lines and columns
/// stay the same.
pub(crate) fn without_comments(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut blanked = bytes.to_vec();
    let mut at = 0;
    while at < bytes.len() {
        let end = match bytes[at] {
            b'"' => {
                at = end_of_string(bytes, at);
                continue;
            }
            b'/' if bytes.get(at + 1) == Some(&b'/') => {
                let line = bytes[at..].iter().position(|byte| *byte == b'\n');
                line.map_or(bytes.len(), |length| at + length)
            }
            b'/' if bytes.get(at + 1) == Some(&b'*') => {
                let inner = text.get(at + 2..).and_then(|rest| rest.find("*/"));
                // A comment without an end stays, and is no valid JSON.
                match inner {
                    Some(length) => at + length + 4,
                    None => break,
                }
            }
            _ => {
                at += 1;
                continue;
            }
        };
        for byte in &mut blanked[at..end] {
            if !matches!(*byte, b'\n' | b'\r') {
                *byte = b' ';
            }
        }
        at = end;
    }
    // Only whole comments were blanked, so this is valid UTF-8.
    String::from_utf8(blanked).unwrap_or_else(|_| text.to_owned())
}

/// The index just after the string that begins at `at`.
fn end_of_string(bytes: &[u8], at: usize) -> usize {
    let mut escaped = false;
    for (place, byte) in bytes.iter().enumerate().skip(at + 1) {
        match byte {
            _ if escaped => escaped = false,
            b'\\' => escaped = true,
            b'"' => return place + 1,
            _ => {}
        }
    }
    bytes.len()
}

/// Line and column, from 1, of the value at a path such as `bodies[2].colliders[0].shape`, or at the
/// longest beginning of the path that exists.
pub(crate) fn locate(text: &str, path: &str) -> (usize, usize) {
    let text = without_comments(text);
    let bytes = text.as_bytes();
    let mut at = skip_blanks(bytes, 0);
    let names = path.split(['.', '[', ']']).filter(|name| !name.is_empty());
    for name in names {
        match entry(&text, at, name) {
            Some(inner) => at = inner,
            None => break,
        }
    }
    let at = at.min(bytes.len());
    let before = &bytes[..at];
    let line = before.iter().filter(|byte| **byte == b'\n').count() + 1;
    let start = before.iter().rposition(|byte| *byte == b'\n');
    (line, at - start.map_or(0, |start| start + 1) + 1)
}

fn skip_blanks(bytes: &[u8], at: usize) -> usize {
    let blank = |byte: &&u8| byte.is_ascii_whitespace();
    at + bytes[at.min(bytes.len())..]
        .iter()
        .take_while(blank)
        .count()
}

/// The index of the value with that key in the object, or with that number in the list, that begins at `at`.
fn entry(text: &str, at: usize, name: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    let is_object = match bytes.get(at)? {
        b'{' => true,
        b'[' => false,
        _ => return None,
    };
    let wanted: Option<usize> = name.parse().ok();
    let mut at = at + 1;
    for number in 0.. {
        at = skip_blanks(bytes, at);
        let mut found = !is_object && wanted == Some(number);
        if is_object {
            if bytes.get(at) != Some(&b'"') {
                return None;
            }
            let end = end_of_string(bytes, at);
            let key = serde_json::from_str::<String>(text.get(at..end)?);
            found = key.is_ok_and(|key| key == name);
            at = skip_blanks(bytes, end) + 1;
            at = skip_blanks(bytes, at);
        }
        if found {
            return Some(at);
        }
        at = skip_blanks(bytes, end_of_value(bytes, at));
        if bytes.get(at) != Some(&b',') {
            return None;
        }
        at += 1;
    }
    None
}

/// The index just after the value that begins at `at`.
fn end_of_value(bytes: &[u8], mut at: usize) -> usize {
    let mut depth = 0_usize;
    while at < bytes.len() {
        match bytes[at] {
            b'"' => {
                at = end_of_string(bytes, at);
                if depth == 0 {
                    return at;
                }
                continue;
            }
            b'{' | b'[' => depth += 1,
            b'}' | b']' if depth == 0 => return at,
            b'}' | b']' => {
                depth -= 1;
                if depth == 0 {
                    return at + 1;
                }
            }
            b',' if depth == 0 => return at,
            _ => {}
        }
        at += 1;
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_are_replaced_by_blanks() {
        let text = "{ // one \u{e9}\n\"a\": \"// no\", /* two\nlines */ \"b\": 2 }";
        let blanked = without_comments(text);
        assert_eq!(blanked.len(), text.len());
        assert_eq!(blanked.lines().count(), text.lines().count());
        let value: serde_json::Value = serde_json::from_str(&blanked).expect("JSON");
        assert_eq!(value["a"], "// no");
        assert_eq!(value["b"], 2);
        assert_eq!(without_comments("[1] /* open"), "[1] /* open");
    }

    #[test]
    fn a_path_is_located_by_line_and_column() {
        let text =
            "{\n  // not \"b\"\n  \"a\": [1, {\"x\": \"}\"}, [2, 3]],\n  \"b\": { \"c\": 4 }\n}";
        assert_eq!(locate(text, ""), (1, 1));
        assert_eq!(locate(text, "a[1].x"), (3, 18));
        assert_eq!(locate(text, "a[2][1]"), (3, 28));
        assert_eq!(locate(text, "b.c"), (4, 15));
        assert_eq!(locate(text, "b.missing.more"), (4, 8));
        assert_eq!(locate("", "a"), (1, 1));
    }
}
