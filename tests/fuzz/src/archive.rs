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

/// What is in an FMU.
#[derive(Debug)]
pub(crate) struct Opened {
    pub(crate) description: Description,
    pub(crate) library: PathBuf,
    /// Its folder of this name, if it has one
    pub(crate) resources: Option<PathBuf>,
}

/// The description of the FMU, its library, unless another one is given, and its resources, written into `folder`.
pub(crate) fn open(path: &Path, library: Option<&Path>, folder: &Path) -> Result<Opened, ArchiveError> {
    let in_file = |source| ArchiveError::File { path: path.into(), source };
    let in_zip = |source| ArchiveError::Zip { path: path.into(), source };
    let mut zip = zip::ZipArchive::new(File::open(path).map_err(in_file)?).map_err(in_zip)?;
    let mut xml = String::new();
    zip.by_name("modelDescription.xml").map_err(in_zip)?.read_to_string(&mut xml).map_err(in_file)?;
    let description = Description::parse(&xml)?;
    let resources = unpack_resources(&mut zip, folder).map_err(in_zip)?;
    if let Some(library) = library {
        return Ok(Opened { description, library: library.into(), resources });
    }
    let name = format!("binaries/{}/{}.so", platform(description.version), description.identifier);
    let mut content = Vec::new();
    zip.by_name(&name).map_err(in_zip)?.read_to_end(&mut content).map_err(in_file)?;
    let target = folder.join(format!("{}.so", description.identifier));
    let in_folder = |source| ArchiveError::File { path: target.clone(), source };
    fs::create_dir_all(folder).map_err(in_folder)?;
    fs::write(&target, content).map_err(in_folder)?;
    Ok(Opened { description, library: target, resources })
}

/// Writes `resources/` into `folder`; none if there is nothing.
fn unpack_resources(
    zip: &mut zip::ZipArchive<File>,
    folder: &Path,
) -> Result<Option<PathBuf>, zip::result::ZipError> {
    let mut found = false;
    for i in 0..zip.len() {
        let mut entry = zip.by_index(i)?;
        let Some(name) = entry.enclosed_name().filter(|name| name.starts_with("resources")) else { continue };
        let target = folder.join(name);
        fs::create_dir_all(target.parent().unwrap_or(folder))?;
        io::copy(&mut entry, &mut File::create(&target)?)?;
        found = true;
    }
    Ok(found.then(|| folder.join("resources")))
}
