//! Tests of texts, their values and their derivatives.

mod random;

use super::names::Axes;
use super::parse::parse;
use super::program::StackCode;
use super::token::ParseError;
use super::*;
use crate::number::{Dual, Number};

fn read(text: &str) -> Result<(StackCode, Vec<Axis>), ParseError> {
    let mut names = Axes::default();
    let program = parse(text, &mut names)?;
    Ok((program, names.into_axes()))
}

/// The value at a point of the plane.
fn at<T: Number<Plain = f64>>(text: &str, [x, y]: [T; 2]) -> T {
    let (program, axes) = read(text).unwrap_or_else(|fault| panic!("{text}: {fault:?}"));
    program.value(|number| match axes[number].name() {
        "x" => x,
        "y" => y,
        _ => f64::NAN.into(),
    })
}

fn value(text: &str) -> f64 {
    at(text, [f64::NAN; 2])
}

/// The value at a point, and its slopes along x and y.
fn slopes(text: &str, [x, y]: [f64; 2]) -> [f64; 3] {
    let axes = [Dual::<2>::input(x, 0), Dual::input(y, 1)];
    let found = at(text, axes);
    [found.re, found.slopes[0], found.slopes[1]]
}

fn near(a: f64, b: f64) -> bool {
    a == b || (a - b).abs() <= 1e-14 * b.abs()
}

#[test]
fn texts_have_their_values() {
    use std::f64::consts::{E, PI, TAU};
    for (text, expected) in [
        ("1", 1.0),
        (".5 + 1.", 1.5),
        ("1e-3", 1e-3),
        ("2.5E+6", 2.5e6),
        ("1.e2*1e2", 1e4),
        ("  7 -\t4\n-2 ", 1.0),
        ("2*3+4*5", 26.0),
        ("2+3*4-5", 9.0),
        ("12/3/2", 2.0),
        ("12/(3/2)", 8.0),
        ("-2^2", -4.0),
        ("(-2)^2", 4.0),
        ("0-2^2", -4.0),
        ("2^-1", 0.5),
        ("2^-1*3", 1.5),
        ("2^-2^2", 0.0625),
        ("-2^-2", -0.25),
        ("2^3^2", 512.0),
        ("2*-3", -6.0),
        ("--3", 3.0),
        ("1--+-1", 0.0),
        ("+2^+2", 4.0),
        ("1 < 2", 1.0),
        ("2 <= 1", 0.0),
        ("1 + 1 > 2 * 1", 0.0),
        ("2 >= 2", 1.0),
        ("0.1 + 0.2 == 0.3", 0.0),
        ("1 != 2", 1.0),
        ("(1 < 2) == (2 < 3)", 1.0),
        ("0 or 1 and 0", 0.0),
        ("(0 or 1) and 0", 0.0),
        ("1 or 1 and 0", 1.0),
        ("1 || 0 && 0", 1.0),
        ("not 1 == 2", 1.0),
        ("!1 == 2", 1.0),
        ("not not 3", 1.0),
        ("not 0 and 0", 0.0),
        ("1 and not 0", 1.0),
        ("if(1, 2, 3)", 2.0),
        ("if(0, 2, 3)", 3.0),
        ("1 + if(1 < 2, 2, 3) * 2", 5.0),
        ("if(0, 1, if(0, 2, 3))^2", 9.0),
        ("2^if(1, 2, 3)", 4.0),
        ("2^if(0, 2, 3)", 8.0),
        ("-if(if(0, 1, 0), 2, 3)", -3.0),
        ("max(if(0, 1, 2), 3, if(1, 4, 5))", 4.0),
        ("PI", PI),
        ("π - TAU/2", 0.0),
        ("τ", TAU),
        ("E*e", E * E),
        ("abs(-3)", 3.0),
        ("sign(0) + 2*sign(-3) + 4*sign(5)", 2.0),
        ("signum(0)", 1.0),
        ("signum(-3)", -1.0),
        ("min(3)", 3.0),
        ("min(3, 1, 2)", 1.0),
        ("max(3, 1, 2)", 3.0),
        ("max(ln(-1), 2)", 2.0),
        ("clamp(5, 1, 3)", 3.0),
        ("clamp(-5, 1, 3)", 1.0),
        ("clamp(2, 1, 3)", 2.0),
        ("floor(-1.5)", -2.0),
        ("ceil(-1.5)", -1.0),
        ("round(2.5)", 3.0),
        ("trunc(-1.5)", -1.0),
        ("fract(-1.25)", -0.25),
        ("sqrt(16)", 4.0),
        ("cbrt(-27)", -3.0),
        ("pow(2, 10)", 1024.0),
        ("2^0.5", 2.0_f64.sqrt()),
        ("(-8)^3", -512.0),
        ("0^0", 1.0),
        ("hypot(3, 4)", 5.0),
        ("hypot(1, 2, 2)", 3.0),
        ("hypot(3e200, 4e200)", 5e200),
        ("exp(1)", E),
        ("ln(E^3)", 3.0),
        ("log(E^2)", 2.0),
        ("log2(8)", 3.0),
        ("log10(1000)", 3.0),
        ("sin(1)", 1.0_f64.sin()),
        ("cos(1)", 1.0_f64.cos()),
        ("tan(1)", 1.0_f64.tan()),
        ("asin(1)", PI / 2.0),
        ("acos(0.5)", 0.5_f64.acos()),
        ("atan(2)", 2.0_f64.atan()),
        ("atan2(1, -2)", 1.0_f64.atan2(-2.0)),
        ("sinh(1)", 1.0_f64.sinh()),
        ("cosh(1)", 1.0_f64.cosh()),
        ("tanh(0.5) + tanh(-0.5)", 0.0),
        ("tanh(0.5)", 0.5_f64.tanh()),
        ("tanh(1e9)", 1.0),
        ("asinh(1)", 1.0_f64.asinh()),
        ("acosh(2)", 2.0_f64.acosh()),
        ("atanh(0.5)", 0.5_f64.atanh()),
        ("10^30", 1e30),
        ("1e-200^-1", 1e200),
        ("2^1000", 2.0_f64.powi(1000)),
        ("(-2)^101", -2.0_f64.powi(101)),
    ] {
        assert!(near(value(text), expected), "{text} is {}", value(text));
    }
}

#[test]
fn names_are_axes() {
    for (text, names) in [
        ("x1 + _heat*ä - αβ9", &["x1", "_heat", "ä", "αβ9"][..]),
        (
            "iffy + orc + and_1 + nota",
            &["iffy", "orc", "and_1", "nota"],
        ),
        ("x + x*X", &["x", "X"]),
        (
            "{heat flux} + {sin}*{E} - {x}",
            &["heat flux", "sin", "E", "x"],
        ),
        ("pi + PI", &["pi"]),
    ] {
        let (_, axes) = read(text).expect("a good text");
        let found: Vec<&str> = axes.iter().map(Axis::name).collect();
        assert_eq!(found, names, "{text}");
    }
    let expression = Expression::new(["y + time", "y", "heat"]);
    let expected = [Axis::Y, Axis::Time, Axis::User("heat".into())];
    assert_eq!(Law::axes(&expression), expected);
}

#[test]
fn error_messages_give_the_character_of_the_fault() {
    for (text, position, message) in [
        ("", 1, "the text is empty"),
        ("  ", 1, "the text is empty"),
        (
            "1 +",
            4,
            "expected a number, a name or `(`, found the end of the text",
        ),
        ("x + * y", 5, "expected a number, a name or `(`, found `*`"),
        ("x y", 3, "expected an operator, found `y`"),
        ("2x", 2, "expected an operator, found `x`"),
        ("2(x)", 2, "expected an operator, found `(`"),
        ("1.2.3", 4, "expected an operator, found `.3`"),
        ("1e", 2, "expected an operator, found `e`"),
        ("2 sin(x)", 3, "expected an operator, found `sin`"),
        ("x ! y", 3, "expected an operator, found `!`"),
        ("π + (x", 5, "this bracket is not closed"),
        ("sin(x", 4, "this bracket is not closed"),
        ("if (x, 1, (2)", 4, "this bracket is not closed"),
        ("{heat", 1, "this bracket is not closed"),
        ("x) + 1", 2, "this bracket closes nothing"),
        ("()", 2, "expected a number, a name or `(`, found `)`"),
        (
            "(1, 2)",
            3,
            "a comma can only stand between the arguments of a function",
        ),
        (
            "1, 2",
            2,
            "a comma can only stand between the arguments of a function",
        ),
        ("sin()", 5, "expected a number, a name or `(`, found `)`"),
        ("sin(1, 2)", 6, "`sin` takes one argument"),
        ("atan2(1)", 8, "`atan2` takes 2 arguments"),
        ("if(1, 2)", 8, "`if` takes 3 arguments"),
        ("if(1, 2, 3, 4)", 11, "`if` takes 3 arguments"),
        (
            "1 + wave(x)",
            5,
            "there is no function `wave`; there are: abs, sign, ",
        ),
        ("1 + sin x", 8, "`sin` is a function: expected `(` after it"),
        ("if", 3, "`if` is a function: expected `(` after it"),
        (
            "x = 1",
            3,
            "`=` is not an operator; `==` compares two numbers",
        ),
        ("x % 2", 3, "`%` cannot stand in an expression"),
        ("x & y", 3, "`&` cannot stand in an expression"),
        ("x − 1", 3, "`\\u{2212}` cannot stand in an expression"),
        ("x²", 2, "`\\u{b2}` cannot stand in an expression"),
        (".", 1, "`.` cannot stand in an expression"),
        ("1 + 1e999", 5, "the number `1e999` is too large"),
        ("1 < x < 2", 7, "comparisons do not chain"),
        ("1 == x == 2", 8, "comparisons do not chain"),
        (
            "-not x",
            2,
            "`not` binds more loosely than what stands before it",
        ),
        (
            "x < !y",
            5,
            "`not` binds more loosely than what stands before it",
        ),
    ] {
        let texts = ["0", text, "1"];
        let error = programs(texts, &mut Axes::default()).expect_err("a bad text");
        let told = error.to_string();
        assert_eq!((error.component, error.position), (1, position), "{told}");
        let place = format!("`{text}`, character {position}: {message}");
        assert!(told.starts_with(&place), "{told}\nis not\n{place}");
    }
}

#[test]
fn error_messages_quote_long_texts_in_part() {
    let long = |length: usize| "x+".repeat(length / 2 - 1) + "xx";
    assert!(read(&long(65_536)).is_ok());
    let fault = |text: &str| *programs([text, "0", "0"], &mut Axes::default()).expect_err("bad");
    let told = fault(&long(65_538)).to_string();
    let end = "character 65537: the text has 65538 characters; at most 65536 are read";
    assert!(told.ends_with(end), "{told}");
    let middle = "x+".repeat(200) + "\n*" + &"+x".repeat(200);
    let told = fault(&middle).to_string();
    assert!(told.starts_with("`…+x+x"), "{told}");
    assert!(
        told.contains("+x+ *+x+") && told.contains("+x…`, character 402: "),
        "{told}"
    );
    let name = "a".repeat(60_000);
    assert!(fault(&format!("1 {name}")).to_string().len() < 300);
    assert!(fault(&format!("{name}(1)")).to_string().len() < 500);
}

/// Derivatives of all functions, compared with central differences.
#[test]
fn slopes_are_those_of_differences() {
    let [x, y] = [0.7, -0.4];
    for text in [
        "-x + 2*y - x*y/(x - y)",
        "abs(x) + abs(y)",
        "min(x, y, 3*y) + max(x*x, x)",
        "clamp(x, -1, 1) + clamp(x, y, y/2) + clamp(3, y, x)",
        "if(x > y, x*x*y, y) + if(x < y, x, sin(y))",
        "fract(5*x) + floor(3*x) + (x < y)",
        "sqrt(x) + cbrt(y)",
        "x^y + (x*x)^x + y^3 + y^-3 + x^2.5 + x^100",
        "hypot(x, y) + hypot(x, 1, y)",
        "exp(x*y) + ln(x) + log2(x) + log10(x)",
        "sin(x) + cos(y) + tan(x*y)",
        "asin(x) + acos(y) + atan(3*x)",
        "atan2(x, y) + atan2(3*y, x) + atan2(y, 2*x)",
        "sinh(x) + cosh(y) + tanh(y) + tanh(x)",
        "asinh(x) + acosh(2 + y) + atanh(y)",
    ] {
        let [middle, by_x, by_y] = slopes(text, [x, y]);
        assert!(near(middle, at(text, [x, y])), "{text}");
        let step = 1e-5;
        let difference = |k: usize| {
            let moved = |by: f64| {
                let mut point = [x, y];
                point[k] += by;
                at(text, point)
            };
            (moved(step) - moved(-step)) / (2.0 * step)
        };
        for (slope, expected) in [(by_x, difference(0)), (by_y, difference(1))] {
            let error = (slope - expected).abs();
            assert!(
                error < 1e-8 * (1.0 + expected.abs()),
                "{text}: {slope}, {expected}"
            );
        }
    }
}

/// Points where the chain rule meets zeros, infinities and corners.
#[test]
fn slopes_are_exact_at_special_points() {
    const ROOT: f64 = std::f64::consts::SQRT_2;
    for (text, point, expected) in [
        ("x^2", [0.0, 0.0], [0.0, 0.0, 0.0]),
        ("x^2", [-3.0, 0.0], [9.0, -6.0, 0.0]),
        ("x^1.0", [0.0, 0.0], [0.0, 1.0, 0.0]),
        ("x^0", [0.0, 0.0], [1.0, 0.0, 0.0]),
        ("x^3", [0.0, 0.0], [0.0, 0.0, 0.0]),
        ("x^2.5", [0.0, 0.0], [0.0, 0.0, 0.0]),
        ("x^2.5", [5e-324, 0.0], [0.0, 0.0, 0.0]),
        ("x^0.5", [0.0, 0.0], [0.0, 0.0, 0.0]),
        ("x^100", [0.0, 0.0], [0.0, 0.0, 0.0]),
        ("x^101", [-1.0, 0.0], [-1.0, 101.0, 0.0]),
        ("x^-1", [1e-100, 0.0], [1e100, -1e200, 0.0]),
        ("x^-2", [1e200, 0.0], [0.0, 0.0, 0.0]),
        ("x^y", [-2.0, 3.0], [-8.0, 12.0, 0.0]),
        ("x^y", [0.0, 2.0], [0.0, 0.0, 0.0]),
        ("x^y", [0.0, 0.0], [1.0, 0.0, 0.0]),
        ("x^y", [1.0, 2.0], [1.0, 2.0, 0.0]),
        ("2^y", [0.0, 1.0], [2.0, 0.0, 2.0 * std::f64::consts::LN_2]),
        ("x^(1 + 1)", [0.0, 0.0], [0.0, 0.0, 0.0]),
        ("x^if(y, 2, 3)", [-2.0, 0.0], [-8.0, 12.0, 0.0]),
        ("sqrt(x)", [0.0, 0.0], [0.0, 0.0, 0.0]),
        ("sqrt(x*x + y*y)", [0.0, 0.0], [0.0, 0.0, 0.0]),
        ("cbrt(x)", [0.0, 0.0], [0.0, 0.0, 0.0]),
        ("hypot(x, y)", [0.0, 0.0], [0.0, 0.0, 0.0]),
        (
            "hypot(x, y)",
            [1e-200, 1e-200],
            [ROOT * 1e-200, 1.0 / ROOT, 1.0 / ROOT],
        ),
        ("abs(x)", [0.0, 0.0], [0.0, 1.0, 0.0]),
        ("abs(x)", [-0.0, 0.0], [0.0, 1.0, 0.0]),
        ("abs(x)", [-2.0, 0.0], [2.0, -1.0, 0.0]),
        ("min(x, y)", [1.0, 1.0], [1.0, 1.0, 0.0]),
        ("max(y, x)", [1.0, 1.0], [1.0, 0.0, 1.0]),
        ("max(x, sqrt(y))", [1.0, -1.0], [1.0, 1.0, 0.0]),
        ("clamp(x, 0, 1)", [1.0, 0.0], [1.0, 1.0, 0.0]),
        (
            "floor(x) + (x < y) + sign(x) + round(x)",
            [0.0, 0.0],
            [0.0; 3],
        ),
        ("fract(x)", [2.0, 0.0], [0.0, 1.0, 0.0]),
        (
            "atan2(y, x)",
            [0.0, 2.0],
            [std::f64::consts::FRAC_PI_2, -0.5, 0.0],
        ),
        (
            "atan2(y, x)",
            [-2.0, 0.0],
            [std::f64::consts::PI, 0.0, -0.5],
        ),
        ("atan2(y, x)", [0.0, 0.0], [0.0, 0.0, 0.0]),
        (
            "asin(x)",
            [1.0, 0.0],
            [std::f64::consts::FRAC_PI_2, 0.0, 0.0],
        ),
        ("acos(x)", [1.0, 0.0], [0.0, 0.0, 0.0]),
        ("acosh(x)", [1.0, 0.0], [0.0, 0.0, 0.0]),
        ("tanh(x)", [0.0, 0.0], [0.0, 1.0, 0.0]),
        ("tanh(x) + tanh(y)", [1e3, -1e3], [0.0, 0.0, 0.0]),
        ("if(x == 0, 0, sin(1/x)/x)", [0.0, 0.0], [0.0, 0.0, 0.0]),
        ("if(x == 0, 1, sin(x)/x)*y", [0.0, 2.0], [2.0, 0.0, 1.0]),
        ("if(x > 0, x, sqrt(x))*0 + y", [2.0, 3.0], [3.0, 0.0, 1.0]),
        ("if(x, y, ln(-1))", [1.0, 3.0], [3.0, 0.0, 1.0]),
    ] {
        let found = slopes(text, point);
        let agree = found.iter().zip(expected).all(|(a, b)| near(*a, b));
        assert!(agree, "{text} at {point:?}: {found:?}, not {expected:?}");
        assert!(near(at(text, point), expected[0]), "{text} at {point:?}");
    }
}

/// Deep nesting, on a stack that is too small for recursion.
#[test]
fn deeply_nested_texts_do_not_overflow_the_stack() {
    let nested = |open: &str, middle: &str, close: &str, levels: usize| {
        open.repeat(levels) + middle + &close.repeat(levels)
    };
    let texts = [
        vec!["x"; 24].join("+"),
        vec!["x"; 1000].join("+"),
        vec!["x"; 32_000].join("^"),
        nested("(", "x", ")", 32_000),
        nested("-", "x", "", 65_000),
        nested("not ", "x", "", 16_000),
        nested("sin(", "x", ")", 13_000),
        nested("x+(", "x", ")", 16_000),
        nested("min(x,", "x", ")", 9_000),
        nested("if(x,x,", "x", ")", 8_000),
        nested("if(", "x", ",x,x)", 8_000),
        nested("(", "", "", 65_000),
        nested("x<(", "", "", 20_000),
        nested("if(x,(", "", "", 9_000),
    ];
    let work = move || {
        for text in &texts {
            let expression = Expression::new([text, "0", "0"]);
            let Ok([program, ..]) = &expression.clone().programs else {
                assert!(text.ends_with('('));
                continue;
            };
            assert_eq!(program.value(|_| 0.0), at(text, [0.0; 2]));
            program.value(|_| Dual::<1>::input(0.0, 0));
        }
    };
    let thread = std::thread::Builder::new().stack_size(64 * 1024);
    let thread = thread.spawn(work).expect("a thread");
    thread.join().expect("enough stack");
}
