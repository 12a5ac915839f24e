//! `documentation/index.html`: the write-up of a model, its variable tables and its reference run on one page.
//!
//! The page holds everything itself: style, icon and diagrams are inline, links stay inside the archive. It is
//! well-formed XML, too, so that a test can read it strictly.

mod plot;
mod ports;
mod samples;
mod variables;

use std::fmt::Write as _;

use model::{Causality, Documentation};
use pulldown_cmark::{Event, HeadingLevel, Options, Parser, Tag, TagEnd, html};
use quick_xml::escape::partial_escape;

use crate::Profile;
use crate::describe::number;
use crate::reference::{self, FOLDER};
use crate::table::Table;
use samples::Samples;

/// Everything that can be wrong with the documentation of a model.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DocumentationError {
    /// The reference results cannot be read.
    #[error("reference results, line {line}: {reason}")]
    Samples {
        /// Line, counting from 1
        line: usize,
        /// Cause
        reason: &'static str,
    },
    /// A diagram shows something that was not recorded.
    #[error("diagram `{title}`: the reference results have no column {signal}")]
    NoColumn {
        /// The diagram
        title: &'static str,
        /// The missing column
        signal: &'static str,
    },
    /// A diagram shows quantities of different units, or something that is no variable.
    #[error("diagram `{title}`: {signal} is no variable in {unit}")]
    Unit {
        /// The diagram
        title: &'static str,
        /// The variable that does not fit
        signal: &'static str,
        /// Unit of the diagram
        unit: &'static str,
    },
}

/// Text for HTML.
fn text(raw: &str) -> String {
    partial_escape(raw).into_owned()
}

/// Write formatted text to the end of a string.
macro_rules! add {
    ($to:expr, $($format:tt)*) => { write!($to, $($format)*).expect("a string takes everything") };
}
use add;

/// Headings of the generated part: anchor and title.
const SECTIONS: [(&str, &str); 7] = [
    ("model", "Model"),
    ("ports", "Ports"),
    ("parameters", "Parameters"),
    ("inputs", "Inputs"),
    ("outputs", "Outputs"),
    ("locals", "Local variables"),
    ("reference", "Reference run"),
];

/// The page of an FMU.
///
/// # Errors
/// [`DocumentationError`].
pub(crate) fn page(profile: &Profile<'_>, table: &Table) -> Result<String, DocumentationError> {
    let samples = Samples::parse(profile.documentation.reference)?;
    let mut page = String::new();
    head(&mut page, profile);
    for (anchor, title) in SECTIONS {
        add!(page, "<section id=\"{anchor}\">\n<h2>{title}</h2>\n");
        match anchor {
            "model" => html::push_html(&mut page, write_up(profile.documentation.text)),
            "ports" => ports::section(&mut page, table),
            "parameters" => parameters(&mut page, profile, table),
            "inputs" => variables::table(&mut page, table, Causality::Input, |_| true),
            "outputs" => variables::table(&mut page, table, Causality::Output, |_| true),
            "locals" => variables::table(&mut page, table, Causality::Local, |_| true),
            _ => reference_run(&mut page, profile, table, &samples)?,
        }
        page.push_str("</section>\n");
    }
    page.push_str(concat!(
        "<footer><p>Licence: <a href=\"licenses/LICENSE-MIT\">MIT</a> or ",
        "<a href=\"licenses/LICENSE-APACHE\">Apache-2.0</a>. Written by koppel ",
        env!("CARGO_PKG_VERSION"),
        ".</p></footer>\n</main>\n</body>\n</html>\n"
    ));
    Ok(page)
}

/// The write-up, its headings one level below the page's.
fn write_up(markdown: &str) -> impl Iterator<Item = Event<'_>> {
    let lower = |level| HeadingLevel::try_from(level as usize + 1).unwrap_or(level);
    Parser::new_ext(markdown, Options::ENABLE_TABLES).map(move |event| match event {
        Event::Start(Tag::Heading { level, id, classes, attrs }) => {
            Event::Start(Tag::Heading { level: lower(level), id, classes, attrs })
        }
        Event::End(TagEnd::Heading(level)) => Event::End(TagEnd::Heading(lower(level))),
        other => other,
    })
}

/// Head of the page, title and list of contents.
fn head(page: &mut String, profile: &Profile<'_>) {
    let (name, description) = (profile.name, text(profile.description));
    add!(page, "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\" />\n");
    add!(page, "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\" />\n");
    add!(page, "<title>{name}: {description}</title>\n<style>\n{}</style>\n", include_str!("style.css"));
    add!(page, "</head>\n<body>\n<main>\n<header>\n{}", profile.documentation.icon_svg);
    add!(page, "<h1>{name}</h1>\n<p>{description}</p>\n</header>\n<nav>\n<ul>\n");
    for (anchor, title) in SECTIONS {
        add!(page, "<li><a href=\"#{anchor}\">{title}</a></li>\n");
    }
    page.push_str("</ul>\n</nav>\n");
}

/// Parameters of the model, then those that every FMU has.
fn parameters(page: &mut String, profile: &Profile<'_>, table: &Table) {
    let own = |i| profile.parameters.contains(&i);
    page.push_str("<p>No parameter is required. A value outside its range is refused when it is set.</p>\n");
    variables::table(page, table, Causality::Parameter, own);
    page.push_str(concat!(
        "<h3>Solver and treatment of inputs</h3>\n<p>The same in every FMU. <code>exact</code> needs a linear ",
        "system; other models refuse it. A fixed step that the chosen explicit method cannot keep stable is ",
        "refused with the largest usable step in the message.</p>\n"
    ));
    variables::table(page, table, Causality::Parameter, |i| !own(i));
}

/// Diagrams and files of the reference run.
fn reference_run(
    page: &mut String,
    profile: &Profile<'_>,
    table: &Table,
    samples: &Samples<'_>,
) -> Result<(), DocumentationError> {
    let Documentation { plots, reference_inputs, .. } = profile.documentation;
    add!(page, "<p>{}</p>\n<ul>\n", text(&reference::description(profile)));
    let file = |page: &mut String, name: String, what: &str| {
        add!(page, "<li><a href=\"../{FOLDER}/{name}\">{name}</a>: {what}</li>\n");
    };
    file(page, reference::results_name(profile), "outputs");
    if reference_inputs.is_some() {
        file(page, reference::inputs_name(profile), "inputs");
    }
    let (start, stop) = (number(profile.start), number(profile.experiment.stop));
    add!(page, "</ul>\n<p>Time runs from {start} to {stop} s.</p>\n");
    plots.iter().try_for_each(|shown| plot::figure(page, shown, table, samples))
}
