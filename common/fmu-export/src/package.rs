//! The archive: model description, binary, documentation, icon and reference results in one zip, the same bytes at
//! every build.

use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;

use model::Model;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use crate::describe::{describe, model_description};
use crate::documentation::{DocumentationError, page};
use crate::reference::{self, FOLDER};
use crate::table::Table;
use crate::terminals::terminals;
use crate::{Profile, Standard};

/// Everything that can go wrong while packing.
#[derive(Debug, thiserror::Error)]
pub enum PackError {
    /// A file cannot be read or written.
    #[error("{path}: {source}")]
    File {
        /// The file
        path: String,
        /// Cause
        source: io::Error,
    },
    /// The description cannot be written.
    #[error("model description: {0}")]
    Description(#[from] io::Error),
    /// The documentation does not fit the model.
    #[error("documentation: {0}")]
    Documentation(#[from] DocumentationError),
    /// The archive cannot be written.
    #[error("archive: {0}")]
    Archive(#[from] zip::result::ZipError),
    /// The command line is not understood.
    #[error("usage: {0} describe --fmi 2|3 | {0} pack --fmi 2|3 --library FILE --output FILE")]
    Usage(&'static str),
}

/// Everything inside the archive: path and content, in any order.
fn contents(
    profile: &Profile<'_>,
    table: &Table,
    standard: Standard,
    library: &[u8],
    extension: &str,
) -> Result<Vec<(String, Vec<u8>)>, PackError> {
    let binary = format!("binaries/{}/{}.{extension}", standard.platform(), profile.name);
    let documentation = profile.documentation;
    let mut files = vec![
        (binary, library.to_vec()),
        ("documentation/index.html".into(), page(profile, table)?.into_bytes()),
        ("documentation/fmi-ls-ref.txt".into(), reference::notes(profile).into_bytes()),
        ("documentation/licenses/license.spdx".into(), b"MIT OR Apache-2.0\n".to_vec()),
        ("documentation/licenses/LICENSE-APACHE".into(), include_bytes!("../../../LICENSE-APACHE").to_vec()),
        ("documentation/licenses/LICENSE-MIT".into(), include_bytes!("../../../LICENSE-MIT").to_vec()),
        ("modelDescription.xml".into(), describe(profile, table, standard)?),
    ];
    let mut references = |name: String, content: Vec<u8>| files.push((format!("{FOLDER}/{name}"), content));
    references("fmi-ls-manifest.xml".into(), reference::manifest(profile)?);
    references(reference::results_name(profile), documentation.reference.into());
    if let Some(inputs) = documentation.reference_inputs {
        references(reference::inputs_name(profile), inputs.into());
    }
    let icon = documentation.icon_png.to_vec();
    match standard {
        Standard::Fmi2 => files.push(("model.png".into(), icon)),
        Standard::Fmi3 => files.extend([
            ("terminalsAndIcons/icon.png".into(), icon),
            ("terminalsAndIcons/icon.svg".into(), documentation.icon_svg.into()),
            ("terminalsAndIcons/terminalsAndIcons.xml".into(), terminals(table.variables())?),
        ]),
    }
    Ok(files)
}

/// The archive for one version of FMI with the shared library `library` inside.
///
/// # Errors
/// [`PackError`].
pub fn archive<M: Model>(standard: Standard, library: &[u8], extension: &str) -> Result<Vec<u8>, PackError> {
    pack(&Profile::of::<M>(), &Table::new::<M>(), standard, (library, extension), Vec::new())
}

/// The archive of an FMU with further files, each with its path inside.
///
/// # Errors
/// [`PackError`].
pub fn pack(
    profile: &Profile<'_>,
    table: &Table,
    standard: Standard,
    (library, extension): (&[u8], &str),
    further: Vec<(String, Vec<u8>)>,
) -> Result<Vec<u8>, PackError> {
    let mut files = contents(profile, table, standard, library, extension)?;
    files.extend(further);
    files.sort(); // the same order wherever it is built
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::default())
        .unix_permissions(0o644);
    let mut zip = ZipWriter::new(io::Cursor::new(Vec::new()));
    for (name, content) in files {
        zip.start_file(name, options)?;
        zip.write_all(&content)?;
    }
    Ok(zip.finish()?.into_inner())
}

fn file<T>(path: &str, result: io::Result<T>) -> Result<T, PackError> {
    result.map_err(|source| PackError::File { path: path.into(), source })
}

fn command<M: Model>(arguments: &[String]) -> Result<(), PackError> {
    let arguments: Vec<_> = arguments.iter().map(String::as_str).collect();
    let standard = match arguments[..] {
        [_, "--fmi", "2", ..] => Standard::Fmi2,
        [_, "--fmi", "3", ..] => Standard::Fmi3,
        _ => return Err(PackError::Usage(M::NAME)),
    };
    match (arguments[0], &arguments[3..]) {
        ("describe", []) => Ok(io::stdout().lock().write_all(&model_description::<M>(standard)?)?),
        ("pack", ["--library", library, "--output", output]) => {
            let extension = Path::new(library).extension().and_then(|e| e.to_str()).unwrap_or("so");
            let archive = archive::<M>(standard, &file(library, fs::read(library))?, extension)?;
            if let Some(folder) = Path::new(output).parent() {
                file(output, fs::create_dir_all(folder))?;
            }
            file(output, fs::write(output, archive))
        }
        _ => Err(PackError::Usage(M::NAME)),
    }
}

/// The program beside each FMU: writes its description, packs its archive.
#[must_use]
pub fn run<M: Model>() -> ExitCode {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    match command::<M>(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // nothing is left to report to if standard error is closed
            let _ = writeln!(io::stderr(), "{}: {error}", M::NAME);
            ExitCode::FAILURE
        }
    }
}
