//! Where the layer's library is.

use std::env;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use screendoor_trace::error::{Error, Result};

/// The variable that names the layer's library.
pub const LIBRARY_VARIABLE: &str = "SCREENDOOR_VULKAN_LAYER";

/// The layer's library: what the variable [`LIBRARY_VARIABLE`] names, or else one beside this
/// program, in `deps` beside it (where Cargo puts it), or in `../lib`.
///
/// # Errors
/// [`Error::Config`] where there is none, with how to build it.
pub fn layer_library() -> Result<PathBuf> {
    let executable = env::current_exe().ok();
    let beside = executable.as_deref().and_then(Path::parent);
    find(env::var_os(LIBRARY_VARIABLE).as_deref(), beside)
}

fn find(named: Option<&OsStr>, beside: Option<&Path>) -> Result<PathBuf> {
    let build = "build it with 'cargo build --release -p screendoor-vulkan-layer'";
    if let Some(named) = named.filter(|n| !n.is_empty()) {
        let path = PathBuf::from(named);
        return match path.canonicalize() {
            Ok(whole) if whole.is_file() => Ok(whole),
            _ => Err(Error::config(
                format_args!("{LIBRARY_VARIABLE} names {}, which is no file", path.display()),
                format_args!("{build}, or leave the variable out"),
            )),
        };
    }
    let name =
        format!("{}screendoor_vulkan_layer{}", env::consts::DLL_PREFIX, env::consts::DLL_SUFFIX);
    let folders = beside
        .into_iter()
        .flat_map(|folder| [folder.to_path_buf(), folder.join("deps"), folder.join("../lib")]);
    let mut places = folders.map(|folder| folder.join(&name));
    let found = places.find_map(|path| path.canonicalize().ok().filter(|p| p.is_file()));
    found.ok_or_else(|| {
        Error::config(
            format_args!("the Vulkan layer {name} is not beside this program"),
            format_args!("{build}, and name it in {LIBRARY_VARIABLE} where it lies elsewhere"),
        )
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn it_is_found_where_it_may_lie() {
        let place = tempfile::tempdir().unwrap();
        let bin = place.path().join("bin");
        fs::create_dir_all(bin.join("deps")).unwrap();
        fs::create_dir_all(place.path().join("lib")).unwrap();
        let missing = find(None, Some(&bin)).unwrap_err().to_string();
        assert!(missing.contains("cargo build --release -p screendoor-vulkan-layer"), "{missing}");
        let name = format!(
            "{}screendoor_vulkan_layer{}",
            env::consts::DLL_PREFIX,
            env::consts::DLL_SUFFIX
        );
        for folder in ["lib", "bin/deps", "bin"] {
            let path = place.path().join(folder).join(&name);
            fs::write(&path, b"").unwrap();
            // Later ones go before those of the turns before.
            assert_eq!(find(None, Some(&bin)).unwrap(), path.canonicalize().unwrap());
        }
        let other = place.path().join("other.so");
        let wrong = find(Some(other.as_os_str()), Some(&bin)).unwrap_err().to_string();
        assert!(wrong.contains("other.so"), "{wrong}");
        fs::write(&other, b"").unwrap();
        assert_eq!(find(Some(other.as_os_str()), None).unwrap(), other.canonicalize().unwrap());
    }
}
