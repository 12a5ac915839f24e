//! What an archive says about its model besides the variables.

/// The write-up of a model, its icon and its reference run. Made by [`documentation!`](crate::documentation).
#[derive(Debug, Clone, Copy)]
pub struct Documentation {
    /// The write-up in Markdown: equations, sources, limits, how it was checked
    pub text: &'static str,
    /// Icon, vector graphics
    pub icon_svg: &'static str,
    /// The same icon as an image
    pub icon_png: &'static [u8],
    /// Results of the reference run, the default experiment: a table with `time` and one column per output
    pub reference: &'static str,
    /// Inputs of the reference run in the same form, if some are not at their start values
    pub reference_inputs: Option<&'static str>,
    /// What the documentation shows of the reference run
    pub plots: &'static [Plot],
}

/// A diagram over time.
#[derive(Debug, Clone, Copy)]
pub struct Plot {
    /// Caption
    pub title: &'static str,
    /// Outputs of one unit
    pub signals: &'static [&'static str],
}

/// The [`Documentation`] of the model `name`: `name.md` beside the calling source file, and in its folder `archive`
/// the files `name.svg`, `name.png`, `name.csv` and, if `inputs` is written, `name_in.csv`.
///
/// ```text
/// const DOCUMENTATION: Documentation = documentation!("link2", plots = [("Angle", ["angle.theta"])]);
/// ```
#[macro_export]
macro_rules! documentation {
    ($name:literal, plots = [$(($title:literal, $signals:expr)),+ $(,)?]) => {
        $crate::documentation!(@ $name, None, [$(($title, $signals)),+])
    };
    ($name:literal, inputs, plots = [$(($title:literal, $signals:expr)),+ $(,)?]) => {
        $crate::documentation!(
            @ $name, Some(include_str!(concat!("archive/", $name, "_in.csv"))), [$(($title, $signals)),+]
        )
    };
    (@ $name:literal, $inputs:expr, [$(($title:literal, $signals:expr)),+]) => {
        $crate::Documentation {
            text: include_str!(concat!($name, ".md")),
            icon_svg: include_str!(concat!("archive/", $name, ".svg")),
            icon_png: include_bytes!(concat!("archive/", $name, ".png")),
            reference: include_str!(concat!("archive/", $name, ".csv")),
            reference_inputs: $inputs,
            plots: &[$($crate::Plot { title: $title, signals: &$signals }),+],
        }
    };
}
