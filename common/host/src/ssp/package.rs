//! Where a scene lies: archive `.ssp`, folder, or one `.ssd` file in a folder.

use std::cell::RefCell;
use std::collections::HashMap;
use std::fs;
use std::path::{Component as PathPart, Path, PathBuf};
use std::rc::Rc;

use tempfile::TempDir;

use super::{SspError, System, read};
use crate::import::{Archive, ArchiveError, Fmu, ImportError};

/// System structure of a scene if no other is named.
const DEFAULT_STRUCTURE: &str = "SystemStructure.ssd";

/// A reference file that the scene does not hold: in the folder `references`, without the first folder of its path.
#[must_use]
pub fn outside_reference(references: &Path, file: &str) -> PathBuf {
    references.join(Path::new(file).components().skip(1).collect::<PathBuf>())
}

/// A scene's files.
pub struct Package {
    path: PathBuf,
    structure: String,
    place: Place,
    fmus: RefCell<HashMap<PathBuf, Rc<Fmu>>>,
}

enum Place {
    Folder(PathBuf),
    Archive(RefCell<Archive>, TempDir),
}

impl Package {
    /// Opens an archive, a folder, or a folder by one of its `.ssd` files.
    ///
    /// # Errors
    /// A path that does not exist or is no archive.
    pub fn open(path: &Path) -> Result<Self, SspError> {
        let (structure, place) = if path.is_dir() {
            (DEFAULT_STRUCTURE.into(), Place::Folder(path.into()))
        } else if path.extension().is_some_and(|e| e == "ssd") {
            let folder = path.parent().unwrap_or(Path::new(".")).into();
            (path.file_name().unwrap_or_default().to_string_lossy().into_owned(), Place::Folder(folder))
        } else {
            let folder = tempfile::Builder::new().prefix("koppel-scene-").tempdir();
            let folder = folder.map_err(|source| SspError::Io { path: path.into(), source })?;
            (DEFAULT_STRUCTURE.into(), Place::Archive(RefCell::new(Archive::open(path)?), folder))
        };
        Ok(Self { path: path.into(), structure, place, fmus: RefCell::default() })
    }

    /// The scene as named by the user.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Another root structure of the same scene, e.g. `foreign.ssd`.
    pub fn choose(&mut self, structure: &str) {
        self.structure = structure.into();
    }

    /// The root structure as it is written.
    ///
    /// # Errors
    /// A missing structure.
    pub fn structure(&self) -> Result<Vec<u8>, SspError> {
        self.read(&self.structure)
    }

    /// Reads the system structure.
    ///
    /// # Errors
    /// A missing or wrong structure, a missing parameter file.
    pub fn system(&self) -> Result<System, SspError> {
        let text = self.read(&self.structure)?;
        read::system(&text, &self.structure, &|source| self.read(source))
    }

    /// Content of a file of the scene.
    ///
    /// # Errors
    /// A missing file, or a path that leads out of the scene.
    pub fn read(&self, name: &str) -> Result<Vec<u8>, SspError> {
        let inside =
            Path::new(name).components().all(|part| matches!(part, PathPart::Normal(_) | PathPart::CurDir));
        if !inside {
            return Err(SspError::Outside { name: name.into() });
        }
        match &self.place {
            Place::Folder(folder) => {
                let path = folder.join(name);
                fs::read(&path).map_err(|source| SspError::Io { path, source })
            }
            Place::Archive(archive, _) => Ok(archive.borrow_mut().read(name)?),
        }
    }

    /// The FMU of a component: from the scene, otherwise from `fallback`. Opened once per file.
    ///
    /// # Errors
    /// An FMU that is in neither, or is none.
    pub fn fmu(&self, source: &str, fallback: &Path) -> Result<Rc<Fmu>, SspError> {
        let path = self.locate(source, fallback)?;
        if let Some(fmu) = self.fmus.borrow().get(&path) {
            return Ok(Rc::clone(fmu));
        }
        let fmu = Fmu::open(&path).map_err(|e| SspError::Import(Box::new(e)))?;
        self.fmus.borrow_mut().insert(path, Rc::clone(&fmu));
        Ok(fmu)
    }

    fn locate(&self, source: &str, fallback: &Path) -> Result<PathBuf, SspError> {
        let name = Path::new(source).file_name().unwrap_or_default();
        let outside = fallback.join(name);
        match &self.place {
            Place::Folder(folder) => {
                let inside = folder.join(source);
                if inside.is_file() {
                    return Ok(inside);
                }
            }
            Place::Archive(archive, folder) => {
                let inside = folder.path().join(name);
                if inside.is_file() {
                    return Ok(inside);
                }
                if archive.borrow().has(source) {
                    let content = archive.borrow_mut().read(source)?;
                    fs::write(&inside, content)
                        .map_err(|source| SspError::Io { path: inside.clone(), source })?;
                    return Ok(inside);
                }
            }
        }
        // a folder is an unpacked FMU
        if outside.exists() {
            return Ok(outside);
        }
        Err(SspError::NoFmu { source_name: source.into(), scene: self.path.clone(), folder: fallback.into() })
    }
}

impl From<ArchiveError> for SspError {
    fn from(error: ArchiveError) -> Self {
        Self::Import(Box::new(ImportError::Archive(error)))
    }
}
