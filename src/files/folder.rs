//! Folders of a service that only its own user may write to.

use std::fs::{self, DirBuilder};
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};

use nix::unistd::{Uid, User};
use rustix::process::{getegid, geteuid};

/// Permission bit: the group may write.
const WRITABLE_BY_GROUP: u32 = 0o020;
/// Permission bit: every user may write.
const WRITABLE_BY_OTHERS: u32 = 0o002;

/// Error when a folder cannot be used by the service.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The folder cannot be created or inspected. Check the permissions of its parent, or name
    /// another folder.
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
    /// The owner of the folder is another user, who could change its files.
    #[error(
        "{} belongs to user {owner}, and the service runs as user {user}. The owner could change \
        the files in it. Run `chown {user} {}`, run the service as the owner, or name another \
        folder",
        folder.display(), folder.display()
    )]
    OtherOwner {
        /// The folder.
        folder: PathBuf,
        /// Owner of the folder.
        owner: u32,
        /// The user of the service.
        user: u32,
    },
    /// Every user may change the content of the folder.
    #[error(
        "every user can write to {}; run `chmod o-w {}`, or name another folder",
        folder.display(), folder.display()
    )]
    Writable {
        /// The folder.
        folder: PathBuf,
    },
    /// Members of another group than the user's own may change the content of the folder.
    #[error(
        "{} can be written by group {group}, and the service's is {own}; take that away with \
         `chmod g-w {}`, or name another folder",
        folder.display(), folder.display()
    )]
    WritableByGroup {
        /// The folder.
        folder: PathBuf,
        /// Group of the folder.
        group: u32,
        /// Group of the service.
        own: u32,
    },
}

/// Creates a folder for the own user if it does not exist. Refuses a folder that other users may
/// change.
///
/// # Errors
/// [`FolderError`].
pub fn own_folder(folder: &Path) -> Result<(), FolderError> {
    let made = DirBuilder::new().recursive(true).mode(0o755).create(folder);
    match made {
        // If the path exists, the check below finds out its type.
        Err(cause) if cause.kind() != io::ErrorKind::AlreadyExists => {
            Err(FolderError::Io { folder: folder.to_owned(), cause })
        }
        _ => check_folder(folder, geteuid().as_raw()),
    }
}

/// Creates a folder of the own user like [`own_folder`], into which no other user can look.
///
/// # Errors
/// Those of [`own_folder`].
pub fn private_folder(folder: &Path) -> Result<(), FolderError> {
    own_folder(folder)?;
    let closed = fs::set_permissions(folder, fs::Permissions::from_mode(0o700));
    closed.map_err(|cause| FolderError::Io { folder: folder.to_owned(), cause })
}

/// Refuses a folder that anyone except the given user and the user's own group may change.
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

/// Returns the own group of a user. For the user of this process it is the group of the process,
/// for others the group in the system's user database.
fn group_of(user: u32) -> u32 {
    let other = (user != geteuid().as_raw()).then(|| User::from_uid(Uid::from_raw(user)));
    let owner = other.and_then(|found| found.ok().flatten());
    owner.map_or(getegid().as_raw(), |available| available.gid.as_raw())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expectation::Expectation;

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
        Expectation::of("runtime-folder-foreign").assert_said(&refused.to_string(), &[]);
    }
}
