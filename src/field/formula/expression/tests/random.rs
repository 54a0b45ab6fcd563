//! Random expressions that are written out and read again, and random texts.

use proptest::prelude::*;

use super::super::function;
use super::*;

/// An expression as a tree, which can be written as text and evaluated.
#[derive(Clone, Debug)]
enum Expr {
    Number(f64),
    Axis(&'static str),
    Negate(Box<Expr>),
    Not(Box<Expr>),
    Binary(&'static Infix, Box<[Expr; 2]>),
    Call(&'static str, Vec<Expr>),
    If(Box<[Expr; 3]>),
}

/// An operator: its text, its precedence and its function.
#[derive(Debug)]
struct Infix {
    mark: &'static str,
    binding: u8,
    does: Does,
}

#[derive(Debug)]
enum Does {
    Add,
    Subtract,
    Multiply,
    Divide,
    Function(function::Function),
}

const NOT: u8 = 3;
const COMPARISON: u8 = 4;
const SIGN: u8 = 7;
const POWER: u8 = 8;
/// Precedence of operands that need no brackets anywhere.
const WORD: u8 = 9;

static OPERATORS: [Infix; 15] = {
    use Does::Function as Does_;
    use function::Function;
    const fn operator(mark: &'static str, binding: u8, does: Does) -> Infix {
        Infix {
            mark,
            binding,
            does,
        }
    }
    [
        operator("or", 1, Does_(Function::Or)),
        operator("||", 1, Does_(Function::Or)),
        operator("and", 2, Does_(Function::And)),
        operator("&&", 2, Does_(Function::And)),
        operator("<", COMPARISON, Does_(Function::Less)),
        operator("<=", COMPARISON, Does_(Function::LessOrEqual)),
        operator(">", COMPARISON, Does_(Function::Greater)),
        operator(">=", COMPARISON, Does_(Function::GreaterOrEqual)),
        operator("==", COMPARISON, Does_(Function::Equal)),
        operator("!=", COMPARISON, Does_(Function::Unequal)),
        operator("+", 5, Does::Add),
        operator("-", 5, Does::Subtract),
        operator("*", 6, Does::Multiply),
        operator("/", 6, Does::Divide),
        operator("^", POWER, Does_(Function::Power)),
    ]
};

const FUNCTIONS: [(&str, usize); 14] = [
    ("abs", 1),
    ("sin", 1),
    ("exp", 1),
    ("ln", 1),
    ("sqrt", 1),
    ("tanh", 1),
    ("floor", 1),
    ("sign", 1),
    ("atan2", 2),
    ("pow", 2),
    ("hypot", 2),
    ("min", 3),
    ("max", 2),
    ("clamp", 3),
];

fn tree() -> impl Strategy<Value = Expr> {
    let leaf = prop_oneof![
        (0_u8..5).prop_map(|n| Expr::Number(n.into())),
        (0.0..10.0).prop_map(Expr::Number),
        Just(Expr::Number(1e-3)),
        Just(Expr::Axis("x")),
        Just(Expr::Axis("y")),
    ];
    leaf.prop_recursive(6, 64, 3, |inner| {
        let operator = (0..OPERATORS.len()).prop_map(|k| &OPERATORS[k]);
        let function = proptest::sample::select(&FUNCTIONS[..]);
        let three = proptest::array::uniform3(inner.clone());
        prop_oneof![
            inner.clone().prop_map(|a| Expr::Negate(a.into())),
            inner.clone().prop_map(|a| Expr::Not(a.into())),
            (operator, inner.clone(), inner)
                .prop_map(|(operator, a, b)| Expr::Binary(operator, [a, b].into())),
            (function, three.clone())
                .prop_map(|((name, count), all)| Expr::Call(name, all[..count].to_vec())),
            three.prop_map(|all| Expr::If(all.into())),
        ]
    })
}

impl Expr {
    /// Returns true if it has neither axes nor conditions.
    fn is_constant(&self) -> bool {
        match self {
            Expr::Number(_) => true,
            Expr::Axis(_) | Expr::If(_) => false,
            Expr::Negate(a) | Expr::Not(a) => a.is_constant(),
            Expr::Binary(_, both) => both.iter().all(Expr::is_constant),
            Expr::Call(_, arguments) => arguments.iter().all(Expr::is_constant),
        }
    }

    fn value<T: Number<Plain = f64>>(&self, [x, y]: [T; 2]) -> T {
        if T::HAS_SLOPES && self.is_constant() {
            return self.value([f64::NAN; 2]).into();
        }
        let at = |tree: &Expr| tree.value([x, y]);
        match self {
            Expr::Number(number) => (*number).into(),
            Expr::Axis("x") => x,
            Expr::Axis(_) => y,
            Expr::Negate(a) => -at(a),
            Expr::Not(a) => function::Function::Not.of(&[at(a)]),
            Expr::Binary(operator, both) => {
                let [a, b] = [at(&both[0]), at(&both[1])];
                match operator.does {
                    Does::Add => a + b,
                    Does::Subtract => a - b,
                    Does::Multiply => a * b,
                    Does::Divide => a / b,
                    Does::Function(function) => function.of(&[a, b]),
                }
            }
            Expr::Call(name, arguments) => {
                let arguments: Vec<T> = arguments.iter().map(at).collect();
                let named = function::named(name).expect("a function");
                named.function.of(&arguments)
            }
            Expr::If(all) => match at(&all[0]).re() {
                0.0 => at(&all[2]),
                _ => at(&all[1]),
            },
        }
    }

    fn binding(&self) -> u8 {
        match self {
            Expr::Number(_) | Expr::Axis(_) | Expr::Call(..) | Expr::If(_) => WORD,
            Expr::Negate(_) => SIGN,
            Expr::Not(_) => NOT,
            Expr::Binary(operator, _) => operator.binding,
        }
    }

    /// Written with brackets around every operation.
    fn bracketed(&self) -> String {
        self.written(&|_, _| true)
    }

    /// Written with no more brackets than needed.
    fn bare(&self) -> String {
        self.written(&|tree, least| tree.binding() < least)
    }

    /// `brackets` decides whether an operand gets brackets, given the precedence below which it needs them.
    fn written(&self, brackets: &impl Fn(&Expr, u8) -> bool) -> String {
        let within = |tree: &Expr, least: u8| {
            let text = tree.written(brackets);
            if tree.binding() < WORD && brackets(tree, least) {
                format!("({text})")
            } else {
                text
            }
        };
        let list = |all: &[Expr]| {
            let all: Vec<String> = all.iter().map(|tree| within(tree, 0)).collect();
            all.join(", ")
        };
        match self {
            Expr::Number(number) => format!("{number:?}"),
            Expr::Axis(name) => (*name).to_owned(),
            Expr::Negate(a) => format!("-{}", within(a, SIGN)),
            Expr::Not(a) => format!("not {}", within(a, NOT)),
            Expr::Call(name, arguments) => format!("{name}({})", list(arguments)),
            Expr::If(all) => format!("if({})", list(&all[..])),
            Expr::Binary(operator, both) => {
                let (left, right) = match operator.binding {
                    POWER => (WORD, SIGN),
                    COMPARISON => (COMPARISON + 1, COMPARISON + 1),
                    binding => (binding, binding + 1),
                };
                let [a, b] = [within(&both[0], left), within(&both[1], right)];
                format!("{a} {} {b}", operator.mark)
            }
        }
    }
}

/// Equal bit by bit, except for the signs of zeros and the kinds of NaN.
fn same(a: f64, b: f64) -> bool {
    a == b || (a.is_nan() && b.is_nan())
}

fn point() -> impl Strategy<Value = [f64; 2]> {
    let coordinate = prop_oneof![Just(0.0), Just(1.0), Just(-2.0), -3.0..3.0];
    proptest::array::uniform2(coordinate)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn written_expressions_keep_their_values_when_read(tree in tree(), point in point()) {
        let expected = tree.value(point);
        let seeded = [0, 1].map(|k| Dual::<2>::input(point[k], k));
        let slopes = |dual: Dual<2>| dual.slopes;
        let moved = tree.value(seeded);
        for text in [tree.bracketed(), tree.bare()] {
            let found = at(&text, point);
            prop_assert!(same(found, expected), "{text}: {found}, not {expected}");
            let found = at(&text, seeded);
            prop_assert!(same(found.re, moved.re), "{text}: {found:?}, not {moved:?}");
            for (a, b) in slopes(found).iter().zip(slopes(moved).iter()) {
                // The program computes constants first, so its slopes may be zero where those of the tree are NaN.
                prop_assert!(same(*a, *b) || b.is_nan(), "{text}: {found:?}, not {moved:?}");
            }
        }
    }

    #[test]
    fn numbers_are_read_as_rust_reads_them(number in 0.0..f64::MAX, small in 0.0..1e-3) {
        for number in [number, small, number * 1e-300] {
            for text in [format!("{number:?}"), format!("{number:e}"), format!("{number:E}")] {
                prop_assert_eq!(value(&text), number);
            }
        }
    }

    #[test]
    fn no_text_panics(text in "\\PC{0,40}") {
        check(&text)?;
    }

    #[test]
    fn no_sequence_of_tokens_panics(
        words in proptest::collection::vec(proptest::sample::select(&WORDS[..]), 0..24),
        between in proptest::sample::select(&["", " "][..]),
    ) {
        check(&words.join(between))?;
    }
}

const WORDS: [&str; 36] = [
    "1", ".5", "2e-3", "e", "x", "y", "PI", "+", "-", "*", "/", "^", "(", ")", "(", ")", ",", ",",
    "<", "<=", "==", "!=", "=", "&&", "||", "and", "or", "not", "!", "if(", "if(", "min(", "sin(",
    "atan2(", "{a b}", "é",
];

/// Checks that a text is read and has values, or is refused at one of its characters.
fn check(text: &str) -> Result<(), TestCaseError> {
    let expression = Expression::new([text, "0", "0"]);
    match &expression.programs {
        Ok([program, ..]) => {
            program.value(|_| 1.0);
            program.value(|_| Dual::<1>::input(1.0, 0));
        }
        Err(error) => {
            let last = text.chars().count() + 1;
            prop_assert!((1..=last).contains(&error.position), "{error}");
        }
    }
    Ok(())
}
