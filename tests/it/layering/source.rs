//! Reads from the tokens of a source file which names it defines, imports and uses.

use std::path::{Path, PathBuf};

/// One name that a `use` brings in.
#[derive(Clone, Debug, PartialEq)]
pub struct Import {
    /// The path as written, without a star at its end.
    pub path: Vec<String>,
    /// The name in this file; `None` for a star.
    pub name: Option<String>,
    /// Whether other files may import it from here.
    pub public: bool,
}

/// A source file, without comments, literals and unit tests.
#[derive(Debug)]
pub struct Source {
    pub file: PathBuf,
    /// Its place in the crate: `["eval", "kernel"]`.
    pub module: Vec<String>,
    pub imports: Vec<Import>,
    /// Items at its top level.
    pub defines: Vec<String>,
    /// Paths outside of `use`, with two segments or more.
    pub paths: Vec<Vec<String>>,
    /// Everything outside of `use`.
    pub tokens: Vec<String>,
    /// Modules declared for tests only.
    pub tests: Vec<String>,
}

impl Source {
    pub fn new(file: &Path, module: Vec<String>, text: &str) -> Self {
        let mut tokens = tokens(text);
        let tests = remove_tests(&mut tokens);
        lift_modules(&mut tokens);
        let imports = remove_imports(&mut tokens);
        remove_modules(&mut tokens);
        Source {
            file: file.to_owned(),
            module,
            imports,
            defines: defines(&tokens),
            paths: paths(&tokens),
            tokens,
            tests,
        }
    }

    /// Whether the name occurs outside of `use`.
    pub fn mentions(&self, name: &str) -> bool {
        self.tokens.iter().any(|token| token == name)
    }
}

fn is_name(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Names, `::`, and all other signs one by one. A literal is a `"`.
fn tokens(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if let Some(length) = literal(rest) {
            found.push("\"".to_owned());
            length
        } else if first.is_whitespace() {
            first.len_utf8()
        } else {
            let not_in_name = |c: char| !c.is_alphanumeric() && c != '_';
            let length = match rest.find(not_in_name).unwrap_or(rest.len()) {
                0 if rest.starts_with("::") => 2,
                0 => first.len_utf8(),
                length => length,
            };
            found.push(rest[..length].to_owned());
            length
        };
        rest = &rest[length..];
    }
    found
}

/// The length of the character literal at the start; a lifetime has no second quote.
fn character(text: &str) -> Option<usize> {
    let body = text.strip_prefix('\'')?;
    let first = body.chars().next()?;
    let least = if first == '\\' { 2 } else { first.len_utf8() };
    let rest = body.get(least..)?;
    let end = if first == '\\' { rest.find('\'')? } else { 0 };
    rest[end..].starts_with('\'').then_some(1 + least + end + 1)
}

/// The length of the string or character literal at the start, if there is one.
fn literal(text: &str) -> Option<usize> {
    let starts = ["r#", "r\"", "br", "b\"", "b'", "\"", "'"];
    if !starts.iter().any(|start| text.starts_with(start)) {
        return None;
    }
    let head = text.strip_prefix('b').unwrap_or(text);
    if head.starts_with('\'') {
        return character(head).map(|length| length + text.len() - head.len());
    }
    let raw = head.strip_prefix('r');
    let hashes = raw.map_or(0, |raw| raw.len() - raw.trim_start_matches('#').len());
    let skipped = text.len() - head.len() + usize::from(raw.is_some()) + hashes;
    let body = text[skipped..].strip_prefix('"')?;
    let end = if raw.is_some() {
        let close = format!("\"{}", "#".repeat(hashes));
        body.find(&close)? + close.len()
    } else {
        let mut escaped = false;
        let at = body.find(|c| {
            let closes = c == '"' && !escaped;
            escaped = c == '\\' && !escaped;
            closes
        });
        at? + 1
    };
    Some(skipped + 1 + end)
}

/// The place after the bracket that closes the one at `open`.
fn after_closing(tokens: &[String], open: usize) -> usize {
    let mut depth = 0;
    for (at, token) in tokens.iter().enumerate().skip(open) {
        match token.as_str() {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" | "}" => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return at + 1;
        }
    }
    tokens.len()
}

/// Removes code that is compiled for tests only; returns the modules declared there.
fn remove_tests(tokens: &mut Vec<String>) -> Vec<String> {
    let mut modules = Vec::new();
    let mut at = 0;
    while at + 3 < tokens.len() {
        if tokens[at] != "#" || tokens[at + 1] != "[" || tokens[at + 2] != "cfg" {
            at += 1;
            continue;
        }
        let body = after_closing(tokens, at + 1);
        let has = |word: &str| tokens[at..body].iter().any(|token| token == word);
        if !has("test") || has("not") {
            at = body;
            continue;
        }
        let mut end = body;
        while end < tokens.len() && tokens[end] != ";" && tokens[end] != "{" {
            end = match tokens[end].as_str() {
                "(" | "[" => after_closing(tokens, end),
                _ => end + 1,
            };
        }
        if tokens.get(end).is_some_and(|token| token == "{") {
            end = after_closing(tokens, end);
        } else if let Some(name) = end.checked_sub(1).filter(|_| tokens[end - 2] == "mod") {
            modules.push(tokens[name].clone());
            end += 1;
        }
        tokens.drain(at..end.min(tokens.len()));
    }
    modules
}

/// Writes paths in `mod … { … }` as from the file: there, one `super` is the file itself.
fn lift_modules(tokens: &mut Vec<String>) {
    let mut at = 0;
    while at + 2 < tokens.len() {
        if tokens[at] == "mod" && tokens[at + 2] == "{" {
            let mut inner = at + 3;
            while inner + 2 < after_closing(tokens, at + 2) {
                if tokens[inner] != "super" || tokens[inner - 1] == "::" {
                    inner += 1;
                } else if tokens[inner + 2] == "super" {
                    tokens.drain(inner..inner + 2);
                    inner += 1;
                } else {
                    tokens[inner] = "self".to_owned();
                }
            }
        }
        at += 1;
    }
}

/// Removes all `use …;`, and returns their imports.
fn remove_imports(tokens: &mut Vec<String>) -> Vec<Import> {
    let mut imports = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        if tokens[at] != "use" {
            at += 1;
            continue;
        }
        let before = at.checked_sub(1).map(|before| tokens[before].as_str());
        let public = matches!(before, Some("pub" | ")"));
        let end = tokens[at..].iter().position(|token| token == ";");
        let end = end.map_or(tokens.len(), |length| at + length);
        tree(&tokens[at + 1..end], &[], public, &mut imports);
        tokens.drain(at..end);
    }
    imports
}

/// Removes all `mod …;`: a file does not need the modules that it declares.
fn remove_modules(tokens: &mut Vec<String>) {
    let mut at = 0;
    while at + 2 < tokens.len() {
        if tokens[at] == "mod" && tokens[at + 2] == ";" {
            tokens.drain(at..at + 3);
        } else {
            at += 1;
        }
    }
}

/// A tree of imports below a prefix; returns how many tokens it had.
fn tree(tokens: &[String], prefix: &[String], public: bool, out: &mut Vec<Import>) -> usize {
    let mut path = prefix.to_vec();
    let mut name = None;
    let mut at = 0;
    while let Some(token) = tokens.get(at) {
        match token.as_str() {
            "::" => {}
            "{" => {
                let end = after_closing(tokens, at);
                let mut item = at + 1;
                while item + 1 < end {
                    item += tree(&tokens[item..end - 1], &path, public, out) + 1;
                }
                return end;
            }
            "*" => {
                out.push(Import {
                    path,
                    name: None,
                    public,
                });
                return at + 1;
            }
            "as" => {
                at += 1;
                name = tokens.get(at).cloned();
            }
            word if is_name(word) => path.push(word.to_owned()),
            _ => break,
        }
        at += 1;
    }
    if path.last().is_some_and(|last| last == "self") {
        path.pop();
    }
    let name = name.or_else(|| path.last().cloned());
    if path.len() > prefix.len() || name.is_some() {
        out.push(Import { path, name, public });
    }
    at
}

/// The names of the items outside of all brackets.
fn defines(tokens: &[String]) -> Vec<String> {
    const KINDS: [&str; 9] = [
        "fn", "struct", "enum", "trait", "type", "const", "static", "union", "mod",
    ];
    let mut found = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let token = tokens[at].as_str();
        if ["(", "[", "{"].contains(&token) {
            at = after_closing(tokens, at);
            continue;
        }
        let after = if token == "macro_rules" { 2 } else { 1 };
        if let Some(name) = tokens.get(at + after) {
            let is_kind = KINDS.contains(&token) || after == 2;
            if is_kind && is_name(name) && !KINDS.contains(&name.as_str()) {
                found.push(name.clone());
            }
        }
        at += 1;
    }
    found
}

/// All `a::b…`.
fn paths(tokens: &[String]) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let mut path = Vec::new();
        while tokens.get(at).is_some_and(|token| is_name(token)) {
            path.push(tokens[at].clone());
            let goes_on = tokens.get(at + 1).is_some_and(|token| token == "::");
            at += if goes_on { 2 } else { 1 };
            if !goes_on {
                break;
            }
        }
        match path.len() {
            0 => at += 1,
            1 => {}
            _ => found.push(path),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Source {
        Source::new(Path::new("here.rs"), vec!["here".to_owned()], text)
    }

    #[test]
    fn imports_are_read_through_braces_stars_and_new_names() {
        let source = read("pub(crate) use a::{self, b::{C as D, *}}; use super::x;");
        let found = source.imports.iter().map(|import| {
            let name = import.name.as_deref().unwrap_or("*");
            format!("{} {name} {}", import.path.join("::"), import.public)
        });
        let expected = [
            "a a true",
            "a::b::C D true",
            "a::b * true",
            "super::x x false",
        ];
        assert_eq!(found.collect::<Vec<_>>(), expected);
    }

    #[test]
    fn paths_in_inner_modules_are_as_from_the_file() {
        let source =
            read("mod inner { use super::A; mod more { fn f() { super::super::super::b::C } } }");
        assert_eq!(source.imports[0].path, ["self", "A"]);
        assert_eq!(source.paths, [["super", "b", "C"]]);
        assert_eq!(source.defines, ["inner"]);
    }

    #[test]
    fn comments_texts_and_tests_are_no_code() {
        let source = read(
            "// crate::a::B\n/* crate::a::B */ fn f<'a>(c: &'a str) { x(\"crate::a\", '\"', '\\'', '\\u{41}', b'x', r#\"\"b::c\"#) }\n\
             #[cfg(test)] mod tests;\n#[cfg(test)]\nmod more { use crate::a::C; fn h() {} }\n\
             const fn g() { crate::real::path() }",
        );
        assert_eq!(source.defines, ["f", "g"]);
        assert_eq!(source.paths, [["crate", "real", "path"]]);
        assert_eq!(source.tests, ["tests"]);
        assert!(source.imports.is_empty() && !source.mentions("B"));
    }
}
