//! The FMU as a file: its description, and its library where it can be loaded.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::description::{Description, DescriptionError};
use crate::standard::Version;

/// Why an FMU cannot be opened.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ArchiveError {
    #[error("{path}: {source}")]
    File { path: PathBuf, source: io::Error },
    #[error("{path}: {source}")]
    Zip { path: PathBuf, source: zip::result::ZipError },
    #[error(transparent)]
    Description(#[from] DescriptionError),
}

/// Folder of the library for this platform.
fn platform(version: Version) -> &'static str {
    match version {
        Version::Fmi2 => "linux64",
        Version::Fmi3 => "x86_64-linux",
    }
}

/// The description of the FMU, and its library: written into `folder`, unless another one is given.
pub(crate) fn open(
    path: &Path,
    library: Option<&Path>,
    folder: &Path,
) -> Result<(Description, PathBuf), ArchiveError> {
    let in_file = |source| ArchiveError::File { path: path.into(), source };
    let in_zip = |source| ArchiveError::Zip { path: path.into(), source };
    let mut zip = zip::ZipArchive::new(File::open(path).map_err(in_file)?).map_err(in_zip)?;
    let mut xml = String::new();
    zip.by_name("modelDescription.xml").map_err(in_zip)?.read_to_string(&mut xml).map_err(in_file)?;
    let description = Description::parse(&xml)?;
    if let Some(library) = library {
        return Ok((description, library.into()));
    }
    let name = format!("binaries/{}/{}.so", platform(description.version), description.identifier);
    let mut content = Vec::new();
    zip.by_name(&name).map_err(in_zip)?.read_to_end(&mut content).map_err(in_file)?;
    let target = folder.join(format!("{}.so", description.identifier));
    let in_folder = |source| ArchiveError::File { path: target.clone(), source };
    fs::create_dir_all(folder).map_err(in_folder)?;
    fs::write(&target, content).map_err(in_folder)?;
    Ok((description, target))
}
