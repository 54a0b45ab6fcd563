//! Items as lines of text: one for the item, and one for each of its public parts.

use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;
use syn::{
    Attribute, Field, Fields, File, FnArg, ImplItem, Item, ItemImpl, Pat, Signature, TraitItem,
    Type,
};

use super::crate_source::{CrateSource, is_for_tests};
use super::is_public;

/// The lines of an item in a module with this path; none if it is not public.
pub fn item_lines(public_path: &str, item: &Item, source: &CrateSource) -> Vec<String> {
    let path = |name: &dyn ToTokens| format!("{public_path}::{}", tidy(name));
    match item {
        Item::Struct(it) if is_public(&it.vis) => {
            let path = path(&it.ident);
            let generics = tidy(&it.generics);
            let mut lines = vec![format!("struct {path}{generics}{}", marks(&it.attrs))];
            lines.extend(public_fields(&path, &it.fields));
            lines.extend(implementations(&it.ident.to_string(), &path, source));
            lines
        }
        Item::Enum(it) if is_public(&it.vis) => {
            let path = path(&it.ident);
            let mut lines = vec![format!(
                "enum {path}{}{}",
                tidy(&it.generics),
                marks(&it.attrs)
            )];
            let variants = it.variants.iter();
            lines.extend(variants.map(|variant| {
                let fields = variant.fields.iter().map(|field| {
                    let name = field.ident.as_ref().map(|name| format!("{name}: "));
                    name.unwrap_or_default() + &tidy(&field.ty)
                });
                let fields = fields.collect::<Vec<_>>().join(", ");
                match variant.fields {
                    Fields::Unit => format!("variant {path}::{}", variant.ident),
                    Fields::Named(_) => format!("variant {path}::{} {{ {fields} }}", variant.ident),
                    Fields::Unnamed(_) => format!("variant {path}::{}({fields})", variant.ident),
                }
            }));
            lines.extend(implementations(&it.ident.to_string(), &path, source));
            lines
        }
        Item::Trait(it) if is_public(&it.vis) => {
            let path = path(&it.ident);
            let bounds = tidy(&it.supertraits);
            let mut lines = vec![format!("trait {path}{}: {bounds}", tidy(&it.generics))];
            lines.extend(it.items.iter().filter_map(|item| match item {
                TraitItem::Fn(it) => Some(function(&path, &it.sig)),
                TraitItem::Const(it) => {
                    Some(format!("const {path}::{}: {}", it.ident, tidy(&it.ty)))
                }
                TraitItem::Type(it) => Some(format!("type {path}::{}", it.ident)),
                _ => None,
            }));
            lines
        }
        Item::Fn(it) if is_public(&it.vis) => vec![function(public_path, &it.sig)],
        Item::Const(it) if is_public(&it.vis) => {
            vec![format!("const {}: {}", path(&it.ident), tidy(&it.ty))]
        }
        Item::Type(it) if is_public(&it.vis) => {
            vec![format!("type {} = {}", path(&it.ident), tidy(&it.ty))]
        }
        Item::ExternCrate(it) if is_public(&it.vis) => {
            let name = it.rename.as_ref().map_or(&it.ident, |(_, name)| name);
            vec![format!("use {public_path}::{name}")]
        }
        _ => Vec::new(),
    }
}

/// The methods, constants and traits of a type. No two types of the crate have the same name.
pub fn implementations(name: &str, path: &str, source: &CrateSource) -> Vec<String> {
    let mut lines = Vec::new();
    for file in source.files() {
        for item in &file.items {
            if let Item::Impl(it) = item
                && !is_for_tests(&it.attrs)
                && is_about(it, name)
            {
                lines.extend(implementation(path, it, file));
            }
        }
    }
    lines
}

/// Returns true for an implementation for this type, or of a conversion from this type into one of another crate.
fn is_about(it: &ItemImpl, name: &str) -> bool {
    matches!(&*it.self_ty, Type::Path(path)
        if path.path.segments.last().is_some_and(|last| last.ident == name))
}

fn implementation(path: &str, it: &ItemImpl, file: &File) -> Vec<String> {
    if let Some((of, _)) = &it.trait_ {
        return vec![format!("impl {} for {path}", tidy(of))];
    }
    let mut lines = Vec::new();
    for item in &it.items {
        match item {
            ImplItem::Fn(it) if is_public(&it.vis) => lines.push(function(path, &it.sig)),
            ImplItem::Const(it) if is_public(&it.vis) => {
                lines.push(format!("const {path}::{}: {}", it.ident, tidy(&it.ty)));
            }
            ImplItem::Macro(it) => {
                let expanded = expand(&tidy(&it.mac.path), file);
                lines.extend(
                    expanded
                        .iter()
                        .flat_map(|inner| implementation(path, inner, file)),
                );
            }
            _ => {}
        }
    }
    lines
}

/// The implementation that a macro without arguments, defined in the same file, stands for.
fn expand(name: &str, file: &File) -> Option<ItemImpl> {
    let rules = file.items.iter().find_map(|item| match item {
        Item::Macro(it) if it.ident.as_ref().is_some_and(|ident| ident == name) => {
            Some(it.mac.tokens.clone())
        }
        _ => None,
    })?;
    let mut groups = rules.into_iter().filter_map(|tree| match tree {
        TokenTree::Group(group) => Some(group.stream()),
        _ => None,
    });
    // The first group is the pattern.
    let body: TokenStream = groups.nth(1)?;
    let text = format!("impl Expanded {{ {body} }}");
    Some(syn::parse_str(&text).expect("items of an implementation"))
}

fn public_fields(path: &str, fields: &Fields) -> Vec<String> {
    let fields = fields
        .iter()
        .enumerate()
        .filter(|(_, field)| is_public(&field.vis));
    let line = |(number, field): (usize, &Field)| {
        let name = field
            .ident
            .as_ref()
            .map_or(number.to_string(), ToString::to_string);
        format!("field {path}::{name}: {}", tidy(&field.ty))
    };
    fields.map(line).collect()
}

fn function(path: &str, signature: &Signature) -> String {
    let mut signature = signature.clone();
    // `mut self` and `mut other` are of no concern to callers.
    let forget_mut = |argument: &mut FnArg| match argument {
        FnArg::Receiver(it) => it.mutability = None,
        FnArg::Typed(it) => {
            if let Pat::Ident(name) = &mut *it.pat {
                name.mutability = None;
            }
        }
    };
    signature.inputs.iter_mut().for_each(forget_mut);
    let text = tidy(&signature);
    let (before, after) = text.split_once("fn ").expect("a function");
    format!("{before}fn {path}::{after}")
}

/// The derived traits of a type, and `non_exhaustive`.
fn marks(attributes: &[Attribute]) -> String {
    let mut marks = String::new();
    for attribute in attributes {
        let path = attribute.path();
        if path.is_ident("non_exhaustive") {
            marks += ", non_exhaustive";
        } else if path.is_ident("derive") || path.is_ident("cfg_attr") {
            let list = attribute.meta.require_list().expect("a list");
            let text = tidy(&list.tokens);
            if path.is_ident("derive") {
                marks += &format!(", derive({text})");
            } else if let Some((_, derived)) = text.split_once("derive(") {
                let derived = derived.split(')').next().unwrap_or_default();
                marks += &format!(", derive({derived})");
            }
        }
    }
    marks
}

/// Tokens as they are usually written.
fn tidy(tokens: &(impl ToTokens + ?Sized)) -> String {
    let mut text = tokens.to_token_stream().to_string();
    for (from, to) in [
        (" :: ", "::"),
        (":: ", "::"),
        (" < ", "<"),
        ("< ", "<"),
        (" >", ">"),
        (" (", "("),
        ("( ", "("),
        (" )", ")"),
        ("[ ", "["),
        (" ]", "]"),
        (" ,", ","),
        (" :", ":"),
        (" ;", ";"),
        ("& ", "&"),
        ("' ", "'"),
        ("->", " -> "),
        ("-  > ", " -> "),
        ("  ", " "),
        (",)", ")"),
    ] {
        text = text.replace(from, to);
    }
    text
}
