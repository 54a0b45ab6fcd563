//! Habits of code and comments that tidy modules are free of.

use super::source::Source;

/// The place after the bracket that closes the one at `open`; angles count as brackets, arrows do not.
fn after_closing(tokens: &[String], open: usize) -> usize {
    let mut depth = 0;
    for (at, token) in tokens.iter().enumerate().skip(open) {
        match token.as_str() {
            "(" | "[" | "{" | "<" => depth += 1,
            ")" | "]" | "}" => depth -= 1,
            ">" if !matches!(tokens[at - 1].as_str(), "-" | "=") => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return at + 1;
        }
    }
    tokens.len()
}

/// The places of a token outside of all brackets.
fn outside<'a>(tokens: &'a [String], wanted: &'a str) -> impl Iterator<Item = usize> + 'a {
    let mut skip_to = 0;
    (0..tokens.len()).filter(move |at| {
        if *at < skip_to {
            return false;
        }
        if matches!(tokens[*at].as_str(), "(" | "[" | "{" | "<") {
            skip_to = after_closing(tokens, *at);
        }
        tokens[*at] == wanted
    })
}

/// Whether a pattern or a type is a tuple, or a reference to one.
fn is_tuple(tokens: &[String]) -> bool {
    let signs = ["&", "mut"];
    let mut at = 0;
    while let Some(token) = tokens.get(at) {
        at += match token.as_str() {
            "'" => 2,
            sign if signs.contains(&sign) => 1,
            _ => break,
        };
    }
    let inner = tokens.get(at + 1..).unwrap_or_default();
    tokens.get(at).is_some_and(|token| token == "(") && {
        let end = after_closing(tokens, at) - at - 2;
        outside(&inner[..end.min(inner.len())], ",")
            .next()
            .is_some()
    }
}

/// The functions that take a tuple as an argument.
fn with_tuples(source: &Source) -> Vec<String> {
    let tokens = &source.tokens;
    let mut found = Vec::new();
    for at in (0..tokens.len().saturating_sub(2)).filter(|at| tokens[*at] == "fn") {
        let mut open = at + 2;
        if tokens[open] == "<" {
            open = after_closing(tokens, open);
        }
        // A function type, `fn(…)`, has no name.
        if tokens.get(open).is_none_or(|token| token != "(") {
            continue;
        }
        let arguments = &tokens[open + 1..after_closing(tokens, open) - 1];
        let ends = outside(arguments, ",").chain([arguments.len()]);
        let mut start = 0;
        for end in ends {
            let argument = &arguments[start..end];
            let colon = outside(argument, ":").next().unwrap_or(argument.len());
            let of_type = argument.get(colon + 1..).unwrap_or_default();
            if is_tuple(&argument[..colon]) || is_tuple(of_type) {
                found.push(format!("fn {} takes a tuple", tokens[at + 1]));
            }
            start = end + 1;
        }
    }
    found
}

/// How often a `match` has an arm for `true` or `false` alone.
fn matches_on_bool(source: &Source) -> usize {
    let arms = source.tokens.windows(3).filter(|arm| {
        let is_flag = arm[0] == "true" || arm[0] == "false";
        is_flag && arm[1] == "=" && arm[2] == ">"
    });
    arms.count()
}

/// Words that say less than a plain sentence does.
const VAGUE: [&str; 6] = [
    "nobody",
    "whoever",
    "so many",
    "as good as",
    "is told of",
    "are told of",
];

/// The comments that begin with "What" as a noun, or contain a vague word.
fn comments(text: &str) -> Vec<String> {
    let lines = text.lines().map(str::trim);
    let comments = lines.filter(|line| line.starts_with("//"));
    let wrong = comments.filter(|line| {
        let words = line.trim_start_matches(['/', '!', ' ', '-']);
        let is_noun = words.starts_with("What ") && !words.contains('?');
        let lower = words.to_lowercase();
        is_noun || VAGUE.iter().any(|vague| lower.contains(vague))
    });
    wrong.map(|line| format!("`{line}`")).collect()
}

/// The habits of a file with this text.
pub fn of(source: &Source, text: &str) -> Vec<String> {
    let mut found = with_tuples(source);
    found.extend(comments(text));
    let arms = matches_on_bool(source);
    if arms > 0 {
        found.push(format!("{arms} arms match on a bool"));
    }
    found
}
