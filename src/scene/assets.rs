//! Assets: models and environments that scenes name and the project does not include.

use crate::Error;
use crate::store::file;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Where the assets are.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Assets {
    /// Nowhere.
    #[default]
    None,
    /// In a folder.
    Folder(PathBuf),
    /// In memory, by their names: for programs without files.
    Memory(BTreeMap<String, Vec<u8>>),
}

impl Assets {
    /// The folder named by the variable `BITLIGHT_ASSETS`, if it is set.
    pub fn from_environment() -> Self {
        std::env::var_os("BITLIGHT_ASSETS").map_or(Self::None, |folder| Self::Folder(folder.into()))
    }

    /// The path of an asset, by which errors name it. An asset in memory has the name that scenes give it.
    ///
    /// # Errors
    /// Where no folder is known or the asset is not there, naming it and what to do.
    pub fn find(&self, name: &str) -> Result<PathBuf, Error> {
        let remedy = "give the folder of assets by --assets DIR or BITLIGHT_ASSETS";
        match self {
            Self::None => {
                Err(Error::new("an asset, and no folder of assets is known").file(name).remedy(remedy))
            }
            Self::Folder(folder) => {
                let path = folder.join(name);
                let absent = || Error::new("there is no such asset").file(&path).remedy(remedy);
                if file::is_file(&path) { Ok(path) } else { Err(absent()) }
            }
            Self::Memory(files) if files.contains_key(name) => Ok(name.into()),
            Self::Memory(_) => {
                Err(Error::new("there is no such asset").file(name).remedy("add it to those in memory"))
            }
        }
    }

    /// The bytes of an asset, at most `most`; `shorter` says what to do about a longer one.
    ///
    /// # Errors
    /// Those of [`Self::find`], and one that cannot be read or is longer.
    pub fn bytes(&self, name: &str, most: u64, shorter: &str) -> Result<Vec<u8>, Error> {
        match self {
            Self::Memory(files) => match files.get(name) {
                Some(bytes) if bytes.len() as u64 <= most => Ok(bytes.clone()),
                Some(_) => Err(Error::new(format!("is longer than {most} bytes")).file(name).remedy(shorter)),
                None => {
                    Err(Error::new("there is no such asset").file(name).remedy("add it to those in memory"))
                }
            },
            _ => file::read(&self.find(name)?, most, shorter),
        }
    }
}
