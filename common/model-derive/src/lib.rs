//! `#[derive(Variables)]` and `#[derive(Enumeration)]`: the variable table of a model from its fields.
//!
//! ```text
//! #[derive(Variables)]
//! #[variables(parameter)]                     parameter | input | output | local
//! pub struct Param {
//!     /// Sprung mass [kg]                    description and unit
//!     #[var(name = "body.mass", start = 400.0, above = 0.0)]
//!     pub m: f64,
//!     #[var(prefix = "strut.")]               a nested group
//!     pub strut: Strut,
//! }
//! ```
//!
//! Keys of `var`: `name`, `prefix`, `start` (a value, or `[x, y, z]`), `item` (an enumeration's
//! variant), `min`, `max`, `above` (exclusive lower bound), `or` (a value out of the range that is allowed too), `any`
//! (values need not be finite), `nominal`, `unit`, `tunable`, `discrete`, `switch` (0 or 1), `local`, `calculated` (a
//! parameter), `sampled` and `not_affine` (of a port), `exact`, `approx`, `state`, `depends` and, for the time derivative
//! of a state,
//! `rate_depends`: names or prefixes of inputs and states, as one list `["a", "b"]`, the name of a
//! constant of type `&[&str]`, or a list of such lists, one per component. `P.a.@` stands for the same component
//! of P.a, `P.a.*` for all components without a scalar P.a, `=P.a` for that scalar alone.
//! A struct with a type parameter `S` is generic over the scalar.

use proc_macro::TokenStream;
use proc_macro2::{TokenStream as Tokens, TokenTree};
use quote::{format_ident, quote};
use syn::{
    Attribute, Data, DeriveInput, Expr, ExprLit, Field, Fields, Lit, Meta, parse_macro_input,
    spanned::Spanned,
};

/// Implement `model::Variables` for a struct. See the crate documentation for the attributes.
#[proc_macro_derive(Variables, attributes(variables, var))]
pub fn variables(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    expand_variables(&input).unwrap_or_else(|e| e.to_compile_error()).into()
}

/// Implement `model::Variables<f64>` for a field-less enum whose items count from 1; item names are the variants in `snake_case`.
#[proc_macro_derive(Enumeration)]
pub fn enumeration(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    expand_enumeration(&input).unwrap_or_else(|e| e.to_compile_error()).into()
}

/// First paragraph of the documentation, with the unit taken off its end.
fn documentation(attrs: &[Attribute]) -> (String, Option<String>) {
    let mut text = String::new();
    for attr in attrs.iter().filter(|a| a.path().is_ident("doc")) {
        if let Meta::NameValue(nv) = &attr.meta
            && let Expr::Lit(ExprLit { lit: Lit::Str(s), .. }) = &nv.value
        {
            let line = s.value();
            if line.trim().is_empty() {
                break;
            }
            if !text.is_empty() {
                text.push(' ');
            }
            text.push_str(line.trim());
        }
    }
    if let Some(open) = text.rfind('[')
        && text.ends_with(']')
    {
        let unit = text[open + 1..text.len() - 1].to_string();
        let description = text[..open].trim().to_string();
        return (description, Some(unit));
    }
    (text, None)
}

#[allow(clippy::struct_excessive_bools, reason = "one for each key without a value")]
#[derive(Default)]
struct FieldAttributes {
    prefix: String,
    unit: Option<String>,
    start: Vec<Tokens>,
    min: Option<Tokens>,
    max: Option<Tokens>,
    or: Option<Tokens>,
    any: bool,
    nominal: Option<Tokens>,
    tunable: bool,
    discrete: bool,
    switch: bool,
    local: bool,
    calculated: bool,
    port: Option<&'static str>,
    initial: Option<&'static str>,
    state: bool,
    depends: Vec<Tokens>,
    rate_depends: Vec<Tokens>,
}

/// One list of names for all components, or one per component.
fn lists(e: &Expr) -> Vec<Tokens> {
    let is_name = |e: &Expr| matches!(e, Expr::Lit(ExprLit { lit: Lit::Str(_), .. }));
    match e {
        Expr::Array(list) if !list.elems.is_empty() && !list.elems.iter().all(is_name) => {
            list.elems.iter().flat_map(lists).collect()
        }
        Expr::Array(list) => {
            let names = &list.elems;
            vec![quote!(&[#names])]
        }
        e => vec![quote!(#e)],
    }
}

/// The unit per second: `rad` -> `rad/s`, `m/s` -> `m/s2`, `J` -> `W`.
fn per_second(unit: &str) -> String {
    match unit {
        "" => "1/s".into(),
        "J" => "W".into(),
        unit => match unit.rsplit_once('/') {
            None => format!("{unit}/s"),
            Some((above, "s")) => format!("{above}/s2"),
            Some((above, below)) => format!("{above}/{below}.s"),
        },
    }
}

/// A start value as f64: Booleans become 0 and 1.
fn number(e: &Expr) -> Tokens {
    match e {
        Expr::Lit(ExprLit { lit: Lit::Bool(b), .. }) => {
            let v = f64::from(u8::from(b.value));
            quote!(#v)
        }
        Expr::Lit(ExprLit { lit: Lit::Int(i), .. }) => quote!(#i as f64),
        e => quote!(#e),
    }
}

fn field_attributes(field: &Field) -> syn::Result<FieldAttributes> {
    let mut a = FieldAttributes::default();
    for attr in field.attrs.iter().filter(|a| a.path().is_ident("var")) {
        attr.parse_nested_meta(|meta| {
            let key = meta.path.get_ident().map(ToString::to_string).unwrap_or_default();
            match key.as_str() {
                "tunable" => a.tunable = true,
                "discrete" => a.discrete = true,
                "switch" => a.switch = true,
                "local" => a.local = true,
                "calculated" => a.calculated = true,
                "any" => a.any = true,
                "sampled" => a.port = Some("Sampled"),
                "not_affine" => a.port = Some("NotAffine"),
                "exact" => a.initial = Some("Exact"),
                "approx" => a.initial = Some("Approx"),
                "name" | "prefix" => a.prefix = meta.value()?.parse::<syn::LitStr>()?.value(),
                "unit" => a.unit = Some(meta.value()?.parse::<syn::LitStr>()?.value()),
                "item" => {
                    let e: Expr = meta.value()?.parse()?;
                    a.start = vec![quote!(#e as i64 as f64)];
                }
                "start" => {
                    let e: Expr = meta.value()?.parse()?;
                    a.start = match &e {
                        Expr::Array(list) => list.elems.iter().map(number).collect(),
                        e => vec![number(e)],
                    };
                }
                "min" | "max" | "or" | "nominal" | "above" => {
                    let e = number(&meta.value()?.parse()?);
                    match key.as_str() {
                        "min" => a.min = Some(e),
                        "max" => a.max = Some(e),
                        "or" => a.or = Some(e),
                        "nominal" => a.nominal = Some(e),
                        // the smallest normal number above an exclusive bound of zero
                        _ => a.min = Some(quote!((#e) + f64::MIN_POSITIVE)),
                    }
                }
                "state" => a.state = true,
                "depends" => a.depends = lists(&meta.value()?.parse()?),
                "rate_depends" => a.rate_depends = lists(&meta.value()?.parse()?),
                _ => return Err(meta.error("unknown key")),
            }
            Ok(())
        })?;
    }
    Ok(a)
}

/// The type with the scalar parameter replaced by f64.
fn concrete(tokens: Tokens, scalar: Option<&syn::Ident>) -> Tokens {
    tokens
        .into_iter()
        .map(|tree| match (tree, scalar) {
            (TokenTree::Ident(i), Some(s)) if i == *s => TokenTree::Ident(format_ident!("f64")),
            (TokenTree::Group(g), _) => {
                TokenTree::Group(proc_macro2::Group::new(g.delimiter(), concrete(g.stream(), scalar)))
            }
            (tree, _) => tree,
        })
        .collect()
}

fn option(v: Option<&Tokens>) -> Tokens {
    v.map_or_else(|| quote!(None), |v| quote!(Some(#v)))
}

/// The causality that `#[variables(...)]` gives to all fields.
fn struct_causality(attrs: &[Attribute]) -> syn::Result<&'static str> {
    let mut causality = "Inherit";
    for attr in attrs.iter().filter(|a| a.path().is_ident("variables")) {
        attr.parse_nested_meta(|meta| {
            causality = match meta.path.get_ident().map(ToString::to_string).as_deref() {
                Some("parameter") => "Parameter",
                Some("input") => "Input",
                Some("output") => "Output",
                Some("local") => "Local",
                _ => return Err(meta.error("parameter, input, output or local")),
            };
            Ok(())
        })?;
    }
    Ok(causality)
}

/// What one field contributes to the expansion.
struct FieldTokens {
    length: Tokens,
    fill: Tokens,
    load: Tokens,
    store: Tokens,
}

fn field_tokens(
    field: &Field,
    scalar: Option<&syn::Ident>,
    number_type: &Tokens,
    causality: &str,
) -> syn::Result<FieldTokens> {
    let ident = field.ident.as_ref().ok_or_else(|| syn::Error::new(field.span(), "name"))?;
    let a = field_attributes(field)?;
    let ty = &field.ty;
    let at_f64 = concrete(quote!(#ty), scalar);
    let table = quote!(<#at_f64 as ::model::Variables<f64>>::TABLE);
    let (description, unit) = documentation(&field.attrs);
    let unit = a.unit.or(unit).unwrap_or_default();
    let unit = if unit == "1" || unit == "-" { String::new() } else { unit };
    let (prefix, start) = (&a.prefix, &a.start);
    let (tunable, discrete, switch) = (a.tunable, a.discrete, a.switch);
    let (depends, rate_depends) = (&a.depends, &a.rate_depends);
    let rate_unit = a.state.then(|| per_second(&unit)).map(|u| quote!(#u));
    let rate_unit = option(rate_unit.as_ref());
    let own = [(a.local, "Local"), (a.calculated, "CalculatedParameter")].into_iter().find(|(own, _)| *own);
    let field_causality = format_ident!("{}", own.map_or(causality, |(_, own)| own));
    let port = format_ident!("{}", a.port.unwrap_or("Regular"));
    let initial = format_ident!("{}", a.initial.unwrap_or("Calculated"));
    let (min, max, nominal) = (option(a.min.as_ref()), option(a.max.as_ref()), option(a.nominal.as_ref()));
    let (or, any) = (option(a.or.as_ref()), a.any);
    Ok(FieldTokens {
        length: quote!(#table.len()),
        fill: quote! {
            table = ::model::fill(table, at, #table, &::model::Attributes {
                prefix: #prefix,
                description: #description,
                unit: #unit,
                causality: ::model::Causality::#field_causality,
                tunable: #tunable,
                discrete: #discrete,
                switch: #switch,
                port: ::model::PortLaw::#port,
                initial: ::model::Initial::#initial,
                start: &[#(#start),*],
                min: #min,
                max: #max,
                or: #or,
                any: #any,
                nominal: #nominal,
                depends: &[#(#depends),*],
                rate_unit: #rate_unit,
                rate_depends: &[#(#rate_depends),*],
            });
            at += #table.len();
        },
        load: quote! {
            let #ident = <#ty as ::model::Variables<#number_type>>::load(&values[at..]);
            at += #table.len();
        },
        store: quote! {
            ::model::Variables::<#number_type>::store(&self.#ident, &mut values[at..]);
            at += #table.len();
        },
    })
}

fn expand_variables(input: &DeriveInput) -> syn::Result<Tokens> {
    let name = &input.ident;
    let Data::Struct(data) = &input.data else {
        return Err(syn::Error::new(name.span(), "Variables is derived for structs"));
    };
    let Fields::Named(fields) = &data.fields else {
        return Err(syn::Error::new(name.span(), "fields need names"));
    };
    let scalar = input.generics.type_params().next().map(|p| p.ident.clone());
    let causality = struct_causality(&input.attrs)?;
    let number_type = scalar.as_ref().map_or_else(|| quote!(f64), |s| quote!(#s));
    let (mut lengths, mut fills, mut loads, mut stores) = (vec![], vec![], vec![], vec![]);
    for field in &fields.named {
        let tokens = field_tokens(field, scalar.as_ref(), &number_type, causality)?;
        lengths.push(tokens.length);
        fills.push(tokens.fill);
        loads.push(tokens.load);
        stores.push(tokens.store);
    }
    let idents: Vec<_> = fields.named.iter().map(|f| &f.ident).collect();
    let (generics, target) = match &scalar {
        Some(s) => (quote!(<#s: ::model::Scalar>), quote!(#name<#s>)),
        None => (quote!(), quote!(#name)),
    };
    let default = (causality == "Parameter" && scalar.is_none()).then(|| {
        quote! {
            impl Default for #name {
                fn default() -> Self {
                    let start: Vec<f64> =
                        <Self as ::model::Variables<f64>>::TABLE.iter().map(|v| v.start).collect();
                    <Self as ::model::Variables<f64>>::load(&start)
                }
            }
        }
    });
    Ok(quote! {
        impl #generics ::model::Variables<#number_type> for #target {
            #[allow(clippy::large_stack_arrays, reason = "evaluated by the compiler")]
            const TABLE: &'static [::model::Entry] = &{
                const N: usize = 0 #(+ #lengths)*;
                let mut table = [::model::Entry::scalar("", ::model::Kind::Float64); N];
                let mut at = 0;
                #(#fills)*
                assert!(at == N);
                table
            };
            #[inline]
            fn load(values: &[#number_type]) -> Self {
                let mut at = 0;
                #(#loads)*
                let _ = at;
                Self { #(#idents),* }
            }
            #[inline]
            fn store(&self, values: &mut [#number_type]) {
                let mut at = 0;
                #(#stores)*
                let _ = at;
            }
        }
        #default
    })
}

/// `SphericalRod` -> `spherical_rod`; a single letter is the name of a point and stays.
fn snake_case(name: &str) -> String {
    if name.len() == 1 {
        return name.to_string();
    }
    let mut out = String::new();
    for (i, c) in name.char_indices() {
        if c.is_uppercase() && i > 0 {
            out.push('_');
        }
        out.extend(c.to_lowercase());
    }
    out
}

fn expand_enumeration(input: &DeriveInput) -> syn::Result<Tokens> {
    let name = &input.ident;
    let Data::Enum(data) = &input.data else {
        return Err(syn::Error::new(name.span(), "Enumeration is derived for enums"));
    };
    let type_name = name.to_string();
    let (description, _) = documentation(&input.attrs);
    let mut items = vec![];
    for v in &data.variants {
        let ident = &v.ident;
        let (text, _) = documentation(&v.attrs);
        let item = snake_case(&ident.to_string());
        items.push(quote! {
            ::model::Item { name: #item, value: #name::#ident as i64, description: #text }
        });
    }
    let variants: Vec<_> = data.variants.iter().map(|v| &v.ident).collect();
    let first = variants.first().ok_or_else(|| syn::Error::new(name.span(), "no items"))?;
    Ok(quote! {
        impl ::model::Variables<f64> for #name {
            const TABLE: &'static [::model::Entry] = &[{
                static TYPE: ::model::EnumType = ::model::EnumType {
                    name: #type_name,
                    description: #description,
                    items: &[#(#items),*],
                };
                let mut entry = ::model::Entry::scalar("", ::model::Kind::Enumeration(&TYPE));
                entry.start = #name::#first as i64 as f64;
                entry
            }];
            fn load(values: &[f64]) -> Self {
                #[allow(clippy::cast_possible_truncation, reason = "items are whole numbers")]
                let index = values[0] as i64;
                #(if index == #name::#variants as i64 { return #name::#variants; })*
                unreachable!("values are checked when they are set")
            }
            fn store(&self, values: &mut [f64]) {
                values[0] = *self as i64 as f64;
            }
        }
    })
}
