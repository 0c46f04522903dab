//! Folders of a service that only its own user may write to.

use std::fs::{self, DirBuilder};
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};

use nix::unistd::{Uid, User};
use rustix::process::{getegid, geteuid};

/// The group may write.
const WRITABLE_BY_GROUP: u32 = 0o020;
/// Anybody may write.
const WRITABLE_BY_OTHERS: u32 = 0o002;

/// Error when a folder cannot belong to the service.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// It cannot be created or inspected. Check its parent's permissions, or name another one.
    #[error(
        "{}: {cause}; check the permissions of its parent folder, or name another one",
        folder.display()
    )]
    Io {
        /// The folder.
        folder: PathBuf,
        /// Message of the system.
        cause: io::Error,
    },
    /// The path exists and is not a folder.
    #[error("{} is not a folder; name another one", folder.display())]
    NotAFolder {
        /// The path.
        folder: PathBuf,
    },
    /// Its owner may change the files in it.
    #[error(
        "{} belongs to user {owner}, and the service runs as user {user}. The owner could change \
        the files in it. Run `chown {user} {}`, run the service as the owner, or name another \
        folder",
        folder.display(), folder.display()
    )]
    OtherOwner {
        /// The folder.
        folder: PathBuf,
        /// Its owner.
        owner: u32,
        /// The user of the service.
        user: u32,
    },
    /// Anybody may change its content.
    #[error(
        "every user can write to {}; run `chmod o-w {}`, or name another folder",
        folder.display(), folder.display()
    )]
    Writable {
        /// The folder.
        folder: PathBuf,
    },
    /// Members of a group that is not the user's own may change its content.
    #[error(
        "{} can be written by group {group}, and the service's is {own}; take that away with \
         `chmod g-w {}`, or name another folder",
        folder.display(), folder.display()
    )]
    WritableByGroup {
        /// The folder.
        folder: PathBuf,
        /// Its group.
        group: u32,
        /// Group of the service.
        own: u32,
    },
}

/// Creates a folder of the own user if needed, and refuses one that others may change.
///
/// # Errors
/// [`FolderError`].
pub fn own_folder(folder: &Path) -> Result<(), FolderError> {
    let made = DirBuilder::new().recursive(true).mode(0o755).create(folder);
    match made {
        // If the path exists, the check below reports what it is.
        Err(cause) if cause.kind() != io::ErrorKind::AlreadyExists => {
            Err(FolderError::Io { folder: folder.to_owned(), cause })
        }
        _ => check_folder(folder, geteuid().as_raw()),
    }
}

/// Refuses a folder that anyone except the given user and that user's own group may change.
///
/// # Errors
/// [`FolderError`].
pub fn check_folder(folder: &Path, user: u32) -> Result<(), FolderError> {
    let data = fs::metadata(folder)
        .map_err(|cause| FolderError::Io { folder: folder.to_owned(), cause })?;
    let (owner, folder) = (data.uid(), folder.to_owned());
    if !data.is_dir() {
        Err(FolderError::NotAFolder { folder })
    } else if owner != user {
        Err(FolderError::OtherOwner { folder, owner, user })
    } else if data.mode() & WRITABLE_BY_OTHERS != 0 {
        Err(FolderError::Writable { folder })
    } else if data.mode() & WRITABLE_BY_GROUP != 0 && data.gid() != group_of(user) {
        Err(FolderError::WritableByGroup { folder, group: data.gid(), own: group_of(user) })
    } else {
        Ok(())
    }
}

/// Returns a user's own group: that of this process, or the one known to the system.
fn group_of(user: u32) -> u32 {
    let other = (user != geteuid().as_raw()).then(|| User::from_uid(Uid::from_raw(user)));
    let owner = other.and_then(|found| found.ok().flatten());
    owner.map_or(getegid().as_raw(), |available| available.gid.as_raw())
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    #[test]
    fn a_folder_that_others_may_change_is_refused() {
        let above = tempfile::tempdir().unwrap();
        let folder = above.path().join("a/b");
        own_folder(&folder).unwrap();
        fs::set_permissions(&folder, fs::Permissions::from_mode(0o777)).unwrap();
        let refused = own_folder(&folder).unwrap_err();
        assert!(matches!(refused, FolderError::Writable { .. }), "{refused}");
        // Its own group may write, for systems where every user has one. Root may change the group.
        fs::set_permissions(&folder, fs::Permissions::from_mode(0o775)).unwrap();
        own_folder(&folder).unwrap();
        if geteuid().is_root() {
            std::os::unix::fs::chown(&folder, None, Some(65_534)).unwrap();
            let refused = own_folder(&folder).unwrap_err();
            assert!(matches!(refused, FolderError::WritableByGroup { group: 65_534, .. }));
        }
        let file = above.path().join("file");
        fs::write(&file, "").unwrap();
        assert!(matches!(own_folder(&file), Err(FolderError::NotAFolder { .. })));
        // Root may give a folder away. Other users can only test a system folder.
        let of_another = if geteuid().is_root() {
            std::os::unix::fs::chown(above.path().join("a"), Some(65_534), None).unwrap();
            above.path().join("a")
        } else {
            PathBuf::from("/usr")
        };
        let refused = own_folder(&of_another).unwrap_err();
        assert!(refused.to_string().contains("chown"), "{refused}");
    }
}
