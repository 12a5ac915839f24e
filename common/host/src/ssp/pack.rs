//! Packing: a scene's folder and its FMUs into one archive, the same bytes for the same files.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::{Package, SspError, outside_reference};

/// Packs a folder with the FMUs of all its structures and its reference results; the result lists the entries.
///
/// # Errors
/// A scene that cannot be read, an FMU that is missing, an archive that cannot be written.
pub fn pack(folder: &Path, fmus: &Path, references: &Path, output: &Path) -> Result<Vec<String>, SspError> {
    let mut package = Package::open(folder)?;
    let system = package.system()?;
    let mut files = BTreeMap::new();
    self::files(folder, "", &mut files)?;
    let is_structure =
        |name: &&String| !name.contains('/') && Path::new(name).extension().is_some_and(|e| e == "ssd");
    let variants: Vec<String> = files.keys().filter(is_structure).cloned().collect();
    for structure in variants {
        package.choose(&structure);
        for component in package.system()?.components {
            let fmu = package.fmu(&component.source, fmus)?;
            files.insert(component.source, fmu.path().to_owned());
        }
    }
    if let Some(file) = &system.settings.reference {
        let outside = outside_reference(references, file);
        if !files.contains_key(file) && outside.is_file() {
            files.insert(file.clone(), outside);
        }
    }
    let written = |source: io::Error| SspError::Io { path: output.into(), source };
    let mut zip = ZipWriter::new(File::create(output).map_err(written)?);
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::default());
    for (name, path) in &files {
        let content = fs::read(path).map_err(|source| SspError::Io { path: path.clone(), source })?;
        zip.start_file(name.as_str(), options).map_err(|e| written(e.into()))?;
        zip.write_all(&content).map_err(written)?;
    }
    zip.finish().map_err(|e| written(e.into()))?;
    Ok(files.into_keys().collect())
}

/// Files below a folder by their names in the archive, `prefix` first; links are left out.
///
/// # Errors
/// A folder that cannot be read.
pub fn files(folder: &Path, prefix: &str, found: &mut BTreeMap<String, PathBuf>) -> Result<(), SspError> {
    let failed = |source| SspError::Io { path: folder.into(), source };
    for entry in fs::read_dir(folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let kind = entry.file_type().map_err(failed)?;
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if kind.is_dir() {
            self::files(&entry.path(), &format!("{name}/"), found)?;
        } else if kind.is_file() {
            found.insert(name, entry.path());
        }
    }
    Ok(())
}
