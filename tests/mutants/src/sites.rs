//! The places of a source file at which it can be changed.

use std::ops::Range;

use proc_macro2::Span;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};

/// A change of a source text.
#[derive(Clone, Debug)]
pub struct Site {
    /// The bytes that are replaced.
    pub bytes: Range<usize>,
    /// The text with the switch, in which `SWITCH` stands for the condition.
    pub text: String,
    /// The change in short.
    pub change: String,
    pub line: usize,
}

/// All changes of a source file.
pub fn sites(source: &str) -> Vec<Site> {
    let file = syn::parse_file(source).expect("a source file");
    let mut found = Finder {
        source,
        sites: Vec::new(),
    };
    found.visit_file(&file);
    found.sites
}

struct Finder<'a> {
    source: &'a str,
    sites: Vec<Site>,
}

fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|it| match &it.meta {
        syn::Meta::List(list) => it.path().is_ident("cfg") && list.tokens.to_string() == "test",
        meta => meta.path().is_ident("test"),
    })
}

/// The operator that takes the place of another; none for one that changes the type of the result for some operands.
fn other(operator: &syn::BinOp) -> Option<&'static str> {
    use syn::BinOp::{Add, And, Div, Eq, Ge, Gt, Le, Lt, Mul, Ne, Or, Sub};
    Some(match operator {
        Add(_) => "-",
        Sub(_) => "+",
        Mul(_) => "/",
        Div(_) => "*",
        Lt(_) => "<=",
        Le(_) => "<",
        Gt(_) => ">=",
        Ge(_) => ">",
        Eq(_) => "!=",
        Ne(_) => "==",
        And(_) => "||",
        Or(_) => "&&",
        _ => return None,
    })
}

/// Results that take the place of those of a function.
fn results(output: &syn::ReturnType) -> Vec<&'static str> {
    let syn::ReturnType::Type(_, output) = output else {
        return vec![""];
    };
    let syn::Type::Path(path) = &**output else {
        return Vec::new();
    };
    let Some(last) = path.path.segments.last() else {
        return Vec::new();
    };
    match last.ident.to_string().as_str() {
        "bool" => vec!["true", "false"],
        "Option" => vec!["None"],
        "f64" | "Real" => vec!["0.0", "1.0"],
        "usize" | "u32" | "u64" => vec!["0", "1"],
        "Vec" => vec!["Vec::new()"],
        _ => Vec::new(),
    }
}

impl Finder<'_> {
    fn text(&self, span: Span) -> &str {
        &self.source[span.byte_range()]
    }

    fn add(&mut self, span: Span, text: String, change: String) {
        self.sites.push(Site {
            bytes: span.byte_range(),
            text,
            change,
            line: span.start().line,
        });
    }

    /// An expression that takes the place of another.
    fn replace(&mut self, span: Span, by: &str) {
        let was = self.text(span).to_owned();
        let change = format!("{was} -> {by}");
        self.add(
            span,
            format!("(if SWITCH {{ {by} }} else {{ {was} }})"),
            change,
        );
    }

    fn function(&mut self, signature: &syn::Signature, block: &syn::Block) {
        let braces = block.brace_token.span.open();
        for result in results(&signature.output) {
            let text = format!("{{ if SWITCH {{ return {result}; }}");
            let change = format!("{} returns {result}", signature.ident);
            self.add(braces, text, change);
        }
    }
}

impl<'a> Visit<'a> for Finder<'_> {
    fn visit_item(&mut self, item: &'a syn::Item) {
        match item {
            syn::Item::Mod(it) if is_test(&it.attrs) => {}
            syn::Item::Fn(it) if is_test(&it.attrs) || it.sig.constness.is_some() => {}
            syn::Item::Const(_) | syn::Item::Static(_) | syn::Item::Enum(_) => {}
            syn::Item::Fn(it) => {
                self.function(&it.sig, &it.block);
                visit::visit_item(self, item);
            }
            _ => visit::visit_item(self, item),
        }
    }

    fn visit_impl_item(&mut self, item: &'a syn::ImplItem) {
        match item {
            syn::ImplItem::Const(_) => {}
            syn::ImplItem::Fn(it) if it.sig.constness.is_some() || is_test(&it.attrs) => {}
            syn::ImplItem::Fn(it) => {
                self.function(&it.sig, &it.block);
                visit::visit_impl_item(self, item);
            }
            _ => visit::visit_impl_item(self, item),
        }
    }

    fn visit_type(&mut self, _: &'a syn::Type) {}

    fn visit_generics(&mut self, _: &'a syn::Generics) {}

    fn visit_pat(&mut self, _: &'a syn::Pat) {}

    fn visit_expr_const(&mut self, _: &'a syn::ExprConst) {}

    fn visit_expr_repeat(&mut self, repeat: &'a syn::ExprRepeat) {
        self.visit_expr(&repeat.expr);
    }

    fn visit_expr_binary(&mut self, binary: &'a syn::ExprBinary) {
        // A chain of `let` is no expression by itself.
        if has_let(&binary.left) || has_let(&binary.right) {
            return visit::visit_expr_binary(self, binary);
        }
        if let Some(other) = other(&binary.op) {
            let (left, right) = (
                self.text(binary.left.span()),
                self.text(binary.right.span()),
            );
            let by = format!("{left} {other} {right}");
            self.replace(binary.span(), &by);
        }
        visit::visit_expr_binary(self, binary);
    }

    fn visit_expr_unary(&mut self, unary: &'a syn::ExprUnary) {
        if matches!(unary.op, syn::UnOp::Neg(_) | syn::UnOp::Not(_)) {
            let by = self.text(unary.expr.span()).to_owned();
            self.replace(unary.span(), &by);
        }
        visit::visit_expr_unary(self, unary);
    }

    fn visit_expr_lit(&mut self, literal: &'a syn::ExprLit) {
        if let syn::Lit::Float(number) = &literal.lit
            && number.base10_parse::<f64>().is_ok_and(|it| it != 0.0)
        {
            let by = format!("{} * 1.5", self.text(number.span()));
            self.replace(number.span(), &by);
        }
    }

    fn visit_stmt(&mut self, statement: &'a syn::Stmt) {
        if let syn::Stmt::Expr(expression, Some(_)) = statement
            && is_effect(expression)
        {
            let was = self.text(statement.span()).to_owned();
            let change = format!("without {was}");
            self.add(statement.span(), format!("if !SWITCH {{ {was} }}"), change);
        }
        visit::visit_stmt(self, statement);
    }
}

fn has_let(expression: &syn::Expr) -> bool {
    match expression {
        syn::Expr::Let(_) => true,
        syn::Expr::Binary(it) => has_let(&it.left) || has_let(&it.right),
        _ => false,
    }
}

/// Returns true if a statement is made for its effect, and can be left out.
fn is_effect(expression: &syn::Expr) -> bool {
    match expression {
        syn::Expr::MethodCall(_) | syn::Expr::Call(_) | syn::Expr::Assign(_) => true,
        syn::Expr::Binary(it) => matches!(
            it.op,
            syn::BinOp::AddAssign(_)
                | syn::BinOp::SubAssign(_)
                | syn::BinOp::MulAssign(_)
                | syn::BinOp::DivAssign(_)
                | syn::BinOp::BitOrAssign(_)
                | syn::BinOp::BitAndAssign(_)
        ),
        _ => false,
    }
}
