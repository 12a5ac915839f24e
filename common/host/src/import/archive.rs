//! Archives: FMUs and SSPs are zip files.
//!
//! What is unpacked is limited in size, never a link, and never outside its folder.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use zip::ZipArchive;
use zip::result::ZipError;

/// Largest sum of unpacked sizes [bytes].
const MAX_SIZE: u64 = 1 << 30;
/// Most entries of an archive.
const MAX_ENTRIES: usize = 100_000;

/// Why an archive is not opened.
#[derive(Debug, thiserror::Error)]
pub enum ArchiveError {
    /// The file cannot be read or written
    #[error("{path}: {source}")]
    Io {
        /// File
        path: PathBuf,
        /// Cause
        source: io::Error,
    },
    /// Not a zip file
    #[error("{path} is no zip archive: {source}")]
    Zip {
        /// File
        path: PathBuf,
        /// Cause
        source: ZipError,
    },
    /// An entry is missing
    #[error("{path} has no entry {entry}")]
    Missing {
        /// Archive
        path: PathBuf,
        /// Entry looked for
        entry: String,
    },
    /// An entry would be written outside the folder, or is a link
    #[error("{path}: entry {entry:?} is a link or leads outside the archive's folder")]
    Unsafe {
        /// Archive
        path: PathBuf,
        /// Its entry
        entry: String,
    },
    /// More than is unpacked
    #[error("{path} unpacks to more than {MAX_SIZE} bytes or {MAX_ENTRIES} entries")]
    TooLarge {
        /// Archive
        path: PathBuf,
    },
}

/// An open archive.
pub struct Archive {
    path: PathBuf,
    zip: ZipArchive<File>,
    left: u64,
}

impl Archive {
    /// Opens an archive.
    ///
    /// # Errors
    /// A file that cannot be read or is no zip.
    pub fn open(path: &Path) -> Result<Self, ArchiveError> {
        let io = |source| ArchiveError::Io { path: path.into(), source };
        let file = File::open(path).map_err(io)?;
        let zip = ZipArchive::new(file).map_err(|source| ArchiveError::Zip { path: path.into(), source })?;
        if zip.len() > MAX_ENTRIES {
            return Err(ArchiveError::TooLarge { path: path.into() });
        }
        Ok(Self { path: path.into(), zip, left: MAX_SIZE })
    }

    /// Whether there is an entry.
    #[must_use]
    pub fn has(&self, entry: &str) -> bool {
        self.zip.index_for_name(entry).is_some()
    }

    /// Content of an entry.
    ///
    /// # Errors
    /// A missing, damaged or too large entry.
    pub fn read(&mut self, entry: &str) -> Result<Vec<u8>, ArchiveError> {
        let Some(index) = self.zip.index_for_name(entry) else {
            return Err(ArchiveError::Missing { path: self.path.clone(), entry: entry.into() });
        };
        self.content(index)
    }

    fn content(&mut self, index: usize) -> Result<Vec<u8>, ArchiveError> {
        let path = &self.path;
        let file =
            self.zip.by_index(index).map_err(|source| ArchiveError::Zip { path: path.clone(), source })?;
        let mut content = Vec::new();
        // the size in the header may lie: one byte more than allowed shows it
        let mut limited = file.take(self.left.saturating_add(1));
        limited
            .read_to_end(&mut content)
            .map_err(|source| ArchiveError::Io { path: path.clone(), source })?;
        match self.left.checked_sub(content.len() as u64) {
            Some(left) => self.left = left,
            None => return Err(ArchiveError::TooLarge { path: path.clone() }),
        }
        Ok(content)
    }

    /// Unpacks the entries that `wanted` names into `folder`.
    ///
    /// # Errors
    /// A link, an entry that leads out of the folder, damaged or too large content, a folder that cannot be written.
    pub fn unpack(&mut self, folder: &Path, wanted: impl Fn(&str) -> bool) -> Result<(), ArchiveError> {
        for index in 0..self.zip.len() {
            let (name, target) = {
                let file = self
                    .zip
                    .by_index(index)
                    .map_err(|source| ArchiveError::Zip { path: self.path.clone(), source })?;
                let name = file
                    .name()
                    .map_err(|source| ArchiveError::Zip { path: self.path.clone(), source })?
                    .into_owned();
                if file.is_dir() || !wanted(&name) {
                    continue;
                }
                match (file.enclosed_name(), file.is_symlink()) {
                    (Some(target), false) => (name, target),
                    _ => return Err(ArchiveError::Unsafe { path: self.path.clone(), entry: name }),
                }
            };
            let content = self.content(index)?;
            let target = folder.join(target);
            let io = |source| ArchiveError::Io { path: PathBuf::from(&name), source };
            if let Some(parent) = target.parent() {
                fs::create_dir_all(parent).map_err(io)?;
            }
            fs::write(&target, content).map_err(io)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use std::io::Write;

    use zip::ZipWriter;
    use zip::write::SimpleFileOptions;

    use super::*;

    fn archive(folder: &Path, write: impl FnOnce(&mut ZipWriter<File>)) -> Archive {
        let path = folder.join("test.zip");
        let mut zip = ZipWriter::new(File::create(&path).unwrap());
        write(&mut zip);
        zip.finish().unwrap();
        Archive::open(&path).unwrap()
    }

    #[test]
    fn entries_that_lead_outside_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let mut outside = archive(folder.path(), |zip| {
            zip.start_file("../escaped", SimpleFileOptions::default()).unwrap();
            zip.write_all(b"x").unwrap();
        });
        let inside = folder.path().join("inside");
        assert!(matches!(outside.unpack(&inside, |_| true), Err(ArchiveError::Unsafe { .. })));
        assert!(!folder.path().join("escaped").exists());
    }

    #[test]
    fn links_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let mut link = archive(folder.path(), |zip| {
            zip.add_symlink("link", "/etc/passwd", SimpleFileOptions::default()).unwrap();
        });
        assert!(matches!(link.unpack(&folder.path().join("in"), |_| true), Err(ArchiveError::Unsafe { .. })));
    }

    #[test]
    fn more_than_the_limit_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let mut small = archive(folder.path(), |zip| {
            zip.start_file("a", SimpleFileOptions::default()).unwrap();
            zip.write_all(&[0; 1000]).unwrap();
        });
        small.left = 999;
        assert!(matches!(small.read("a"), Err(ArchiveError::TooLarge { .. })));
        small.left = 1000;
        assert_eq!(small.read("a").unwrap().len(), 1000);
    }
}
