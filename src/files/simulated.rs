//! A disk that forgets: it records every change, and shows what may be left of them after a crash.
//!
//! A file has its content of the last sync, and of later writes any part. A folder has its names of
//! the last sync, and of later changes any. POSIX promises no more.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::{Arc, Mutex};

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::disk::{Disk, DiskFile, SystemDisk, set_disk};

/// Size that a disk writes completely or not at all \[bytes\].
const SECTOR: usize = 512;

/// A change of the disk. Paths are relative to the folder of the disk.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Change {
    Create(PathBuf, usize),
    Write(usize, Vec<u8>),
    Cut(usize, usize),
    SyncFile(usize),
    Rename(PathBuf, PathBuf),
    Remove(PathBuf),
    Link(PathBuf, String),
    MakeFolder(PathBuf),
    RemoveFolder(PathBuf),
    SyncFolder(PathBuf),
}

/// Failure of the disk from some change on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Failure {
    /// Nothing more fits. The first write that does not fit is written by half.
    Full,
    /// Every change is refused.
    ReadOnly,
}

#[derive(Debug, Default)]
struct Recorded {
    changes: Vec<Change>,
    /// Files by their present names.
    inodes: BTreeMap<PathBuf, usize>,
    next_inode: usize,
    failure: Option<(usize, Failure)>,
    /// Number of changes that were tried.
    tried: usize,
    /// Time that the disk takes for a change, and that it has taken \[ns\].
    change_ns: u64,
    taken_ns: u64,
}

/// The disk of a folder. Changes take effect in the folder as well.
#[derive(Debug)]
pub(crate) struct SimulatedDisk {
    root: PathBuf,
    recorded: Arc<Mutex<Recorded>>,
}

/// Number of the first file that is created on a simulated disk.
const FIRST_NEW_INODE: usize = 1_000_000;

/// A file, folder or link as it is certain, with the changes that are not.
#[derive(Clone, Debug)]
enum Node {
    File(usize),
    Link(String),
    Folder(usize),
}

/// Content of a file.
#[derive(Clone, Debug, Default)]
struct Content {
    certain: Vec<u8>,
    present: Vec<u8>,
}

/// Names of a folder.
#[derive(Clone, Debug, Default)]
struct Names {
    certain: BTreeMap<String, Node>,
    present: BTreeMap<String, Node>,
    pending: Vec<NameChange>,
}

#[derive(Clone, Debug)]
enum NameChange {
    Set(String, Node),
    Remove(String),
    Rename(String, String, Node),
}

impl NameChange {
    fn apply(&self, names: &mut BTreeMap<String, Node>) {
        match self {
            Self::Set(name, node) => drop(names.insert(name.clone(), node.clone())),
            Self::Remove(name) => drop(names.remove(name)),
            Self::Rename(from, to, node) => {
                names.remove(from);
                names.insert(to.clone(), node.clone());
            }
        }
    }

    fn name(&self) -> &str {
        match self {
            Self::Set(name, _) | Self::Remove(name) | Self::Rename(_, name, _) => name,
        }
    }
}

/// The state of a disk after some of its changes.
#[derive(Clone, Debug, Default)]
pub(crate) struct DiskState {
    contents: BTreeMap<usize, Content>,
    folders: BTreeMap<usize, Names>,
}

/// Parts of the uncertain changes that a crash leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Crash {
    /// None.
    Nothing,
    /// All.
    Everything,
    /// The names, without the content of their files.
    NamesOnly,
    /// The names, with torn content.
    NamesAndTorn(u64),
    /// The content, without the names.
    ContentOnly,
    /// The content, and of the names in a folder the newest change, which overtook the others.
    NewestName,
    /// Any.
    Random(u64),
}

impl Crash {
    /// Returns the kinds of crashes to try after a change.
    pub(crate) fn kinds(seed: u64) -> Vec<Self> {
        let random = (0..3).map(|k| Self::Random(4 * seed + k));
        let definite =
            [Self::Nothing, Self::Everything, Self::NamesOnly, Self::ContentOnly, Self::NewestName];
        let torn = [Self::NamesAndTorn(seed), Self::NamesAndTorn(seed + 1)];
        definite.into_iter().chain(torn).chain(random).collect()
    }
}

impl SimulatedDisk {
    /// Creates a disk from a folder, whose content is certain.
    pub(crate) fn new(root: &Path) -> Rc<Self> {
        let recorded = Recorded { next_inode: FIRST_NEW_INODE, ..Recorded::default() };
        Rc::new(Self { root: root.to_owned(), recorded: Arc::new(Mutex::new(recorded)) })
    }

    /// Calls a function with this as the disk of the thread.
    pub(crate) fn run<T>(self: &Rc<Self>, body: impl FnOnce() -> T) -> T {
        self.set();
        let outcome = body();
        set_disk(None);
        outcome
    }

    /// Makes this the disk of the thread.
    pub(crate) fn set(self: &Rc<Self>) {
        let disk: Rc<dyn Disk> = Rc::<Self>::clone(self);
        set_disk(Some(disk));
    }

    /// Lets the disk fail from now on.
    pub(crate) fn fail(&self, failure: Failure) {
        let mut recorded = self.recorded.lock().unwrap();
        recorded.failure = Some((recorded.tried, failure));
    }

    /// Lets every change take so long \[ns\].
    pub(crate) fn be_late(&self, change_ns: u64) {
        self.recorded.lock().unwrap().change_ns = change_ns;
    }

    /// Returns the time that changes took since the last call \[ns\].
    pub(crate) fn take_late_ns(&self) -> u64 {
        std::mem::take(&mut self.recorded.lock().unwrap().taken_ns)
    }

    /// Lets the disk fail from a change on.
    pub(crate) fn fail_from(&self, change: usize, failure: Failure) {
        self.recorded.lock().unwrap().failure = Some((change, failure));
    }

    /// Ends the failure and the delay.
    pub(crate) fn heal(&self) {
        let mut recorded = self.recorded.lock().unwrap();
        (recorded.failure, recorded.change_ns) = (None, 0);
    }

    /// Returns the changes so far.
    pub(crate) fn changes(&self) -> Vec<Change> {
        self.recorded.lock().unwrap().changes.clone()
    }

    /// Returns the number of changes so far.
    pub(crate) fn count(&self) -> usize {
        self.recorded.lock().unwrap().changes.len()
    }

    fn relative(&self, path: &Path) -> PathBuf {
        path.strip_prefix(&self.root).unwrap_or(path).to_owned()
    }

    /// Counts a change, and returns an error if the disk refuses it.
    fn admit(&self, needs_room: bool) -> io::Result<()> {
        let mut recorded = self.recorded.lock().unwrap();
        recorded.tried += 1;
        recorded.taken_ns += recorded.change_ns;
        match recorded.failure {
            Some((from, Failure::ReadOnly)) if recorded.tried > from => {
                Err(io::ErrorKind::ReadOnlyFilesystem.into())
            }
            Some((from, Failure::Full)) if recorded.tried > from && needs_room => {
                Err(io::ErrorKind::StorageFull.into())
            }
            _ => Ok(()),
        }
    }

    fn record(&self, change: Change) {
        self.recorded.lock().unwrap().changes.push(change);
    }

    fn open(&self, path: &Path, file: Box<dyn DiskFile>, is_new: bool) -> Box<dyn DiskFile> {
        let path = self.relative(path);
        let mut recorded = self.recorded.lock().unwrap();
        let inode = match recorded.inodes.get(&path) {
            Some(inode) if !is_new => *inode,
            _ => {
                recorded.next_inode += 1;
                let inode = recorded.next_inode;
                recorded.inodes.insert(path.clone(), inode);
                recorded.changes.push(Change::Create(path, inode));
                inode
            }
        };
        Box::new(SimulatedFile { file, inode, recorded: Arc::clone(&self.recorded) })
    }
}

impl Disk for SimulatedDisk {
    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskFile>> {
        self.admit(true)?;
        Ok(self.open(path, SystemDisk.create(path)?, true))
    }

    fn append(&self, path: &Path) -> io::Result<Box<dyn DiskFile>> {
        let is_there = path.exists();
        self.admit(!is_there)?;
        if is_there {
            let mut recorded = self.recorded.lock().unwrap();
            let relative = self.relative(path);
            // A file of the base has a number by its name.
            let inode = base_inode(&relative);
            recorded.inodes.entry(relative).or_insert(inode);
        }
        Ok(self.open(path, SystemDisk.append(path)?, !is_there))
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.admit(false)?;
        SystemDisk.rename(from, to)?;
        let (from, to) = (self.relative(from), self.relative(to));
        let mut recorded = self.recorded.lock().unwrap();
        match recorded.inodes.remove(&from) {
            Some(inode) => drop(recorded.inodes.insert(to.clone(), inode)),
            // A link replaces a file.
            None => drop(recorded.inodes.remove(&to)),
        }
        recorded.changes.push(Change::Rename(from, to));
        Ok(())
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        self.admit(false)?;
        SystemDisk.remove(path)?;
        let path = self.relative(path);
        self.recorded.lock().unwrap().inodes.remove(&path);
        self.record(Change::Remove(path));
        Ok(())
    }

    fn link(&self, target: &str, path: &Path) -> io::Result<()> {
        self.admit(true)?;
        SystemDisk.link(target, path)?;
        self.record(Change::Link(self.relative(path), target.to_owned()));
        Ok(())
    }

    fn make_folder(&self, path: &Path) -> io::Result<()> {
        let new: Vec<_> = path.ancestors().take_while(|part| !part.exists()).collect();
        if !new.is_empty() {
            self.admit(true)?;
        }
        SystemDisk.make_folder(path)?;
        for part in new.into_iter().rev() {
            self.record(Change::MakeFolder(self.relative(part)));
        }
        Ok(())
    }

    fn remove_folder(&self, path: &Path) -> io::Result<()> {
        if !path.exists() {
            return Err(io::ErrorKind::NotFound.into());
        }
        self.admit(false)?;
        SystemDisk.remove_folder(path)?;
        self.record(Change::RemoveFolder(self.relative(path)));
        Ok(())
    }

    fn sync_folder(&self, path: &Path) -> io::Result<()> {
        self.admit(false)?;
        self.record(Change::SyncFolder(self.relative(path)));
        Ok(())
    }
}

struct SimulatedFile {
    file: Box<dyn DiskFile>,
    inode: usize,
    recorded: Arc<Mutex<Recorded>>,
}

impl SimulatedFile {
    fn failure(&self) -> Option<Failure> {
        let mut recorded = self.recorded.lock().unwrap();
        recorded.tried += 1;
        recorded.taken_ns += recorded.change_ns;
        let tried = recorded.tried;
        recorded.failure.filter(|(from, _)| tried > *from).map(|(_, failure)| failure)
    }

    fn record(&self, change: Change) {
        self.recorded.lock().unwrap().changes.push(change);
    }
}

impl Write for SimulatedFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = match self.failure() {
            Some(Failure::ReadOnly) => return Err(io::ErrorKind::ReadOnlyFilesystem.into()),
            Some(Failure::Full) if bytes.len() < 2 => {
                return Err(io::ErrorKind::StorageFull.into());
            }
            Some(Failure::Full) => &bytes[..bytes.len() / 2],
            None => bytes,
        };
        self.file.write_all(written)?;
        self.record(Change::Write(self.inode, written.to_owned()));
        Ok(written.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl DiskFile for SimulatedFile {
    fn sync(&mut self) -> io::Result<()> {
        if self.failure() == Some(Failure::ReadOnly) {
            return Err(io::ErrorKind::ReadOnlyFilesystem.into());
        }
        self.record(Change::SyncFile(self.inode));
        Ok(())
    }

    fn cut(&mut self, length: u64) -> io::Result<()> {
        if self.failure() == Some(Failure::ReadOnly) {
            return Err(io::ErrorKind::ReadOnlyFilesystem.into());
        }
        self.file.cut(length)?;
        self.record(Change::Cut(self.inode, usize::try_from(length).unwrap()));
        Ok(())
    }

    fn length(&self) -> io::Result<u64> {
        self.file.length()
    }
}

/// Returns the number of a file that was there at the beginning.
fn base_inode(path: &Path) -> usize {
    let bytes = path.as_os_str().as_encoded_bytes();
    1 + bytes.iter().fold(7, |sum: usize, byte| (31 * sum + usize::from(*byte)) % 900_000)
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap().to_str().unwrap().to_owned()
}

impl DiskState {
    /// Returns the state of a folder, all of which is certain.
    pub(crate) fn of_folder(root: &Path) -> Self {
        let mut state = Self::default();
        state.add_folder(root, Path::new(""), 0);
        state
    }

    fn add_folder(&mut self, root: &Path, relative: &Path, inode: usize) {
        let mut names = BTreeMap::new();
        for entry in fs::read_dir(root.join(relative)).unwrap() {
            let entry = entry.unwrap();
            let (path, kind) = (relative.join(entry.file_name()), entry.file_type().unwrap());
            let number = base_inode(&path);
            let node = if kind.is_dir() {
                self.add_folder(root, &path, number);
                Node::Folder(number)
            } else if kind.is_symlink() {
                Node::Link(fs::read_link(entry.path()).unwrap().to_str().unwrap().to_owned())
            } else {
                let certain = fs::read(entry.path()).unwrap();
                let present = certain.clone();
                let earlier = self.contents.insert(number, Content { certain, present });
                assert!(earlier.is_none(), "two files have one number");
                Node::File(number)
            };
            names.insert(name_of(&path), node);
        }
        let (certain, present) = (names.clone(), names);
        self.folders.insert(inode, Names { certain, present, pending: Vec::new() });
    }

    fn folder_of(&self, path: &Path) -> usize {
        let mut inode = 0;
        for part in path {
            match &self.folders[&inode].present[part.to_str().unwrap()] {
                Node::Folder(number) => inode = *number,
                other => panic!("{}: {other:?}", path.display()),
            }
        }
        inode
    }

    fn change_names(&mut self, path: &Path, change: NameChange) {
        let folder = self.folder_of(path.parent().unwrap());
        let names = self.folders.get_mut(&folder).unwrap();
        change.apply(&mut names.present);
        names.pending.push(change);
    }

    /// Applies a change.
    pub(crate) fn apply(&mut self, change: &Change) {
        match change {
            Change::Create(path, inode) => {
                self.contents.insert(*inode, Content::default());
                self.change_names(path, NameChange::Set(name_of(path), Node::File(*inode)));
            }
            Change::Write(inode, bytes) => {
                self.contents.get_mut(inode).unwrap().present.extend_from_slice(bytes);
            }
            Change::Cut(inode, length) => {
                self.contents.get_mut(inode).unwrap().present.truncate(*length);
            }
            Change::SyncFile(inode) => {
                let content = self.contents.get_mut(inode).unwrap();
                content.certain.clone_from(&content.present);
            }
            Change::Rename(from, to) => {
                let folder = self.folder_of(from.parent().unwrap());
                let node = self.folders[&folder].present[&name_of(from)].clone();
                self.change_names(to, NameChange::Rename(name_of(from), name_of(to), node));
            }
            Change::Remove(path) | Change::RemoveFolder(path) => {
                self.change_names(path, NameChange::Remove(name_of(path)));
            }
            Change::Link(path, target) => {
                let node = Node::Link(target.clone());
                self.change_names(path, NameChange::Set(name_of(path), node));
            }
            Change::MakeFolder(path) => {
                let number = 2_000_000 + self.folders.len();
                self.folders.insert(number, Names::default());
                self.change_names(path, NameChange::Set(name_of(path), Node::Folder(number)));
            }
            Change::SyncFolder(path) => {
                let folder = self.folder_of(path);
                let names = self.folders.get_mut(&folder).unwrap();
                names.certain.clone_from(&names.present);
                names.pending.clear();
            }
        }
    }

    /// Names the file or folder that a sync makes certain, by its kind. `None` for other changes.
    pub(crate) fn sync_label(&self, change: &Change) -> Option<String> {
        match change {
            Change::SyncFile(inode) => {
                let is_file = |node: &&Node| matches!(node, Node::File(number) if number == inode);
                let mut folders = self.folders.values();
                let name = folders.find_map(|names| {
                    let mut present = names.present.iter();
                    present.find(|(_, node)| is_file(node)).map(|(name, _)| name.clone())
                })?;
                Some(format!("content of {}", kind_of_name(&name)))
            }
            Change::SyncFolder(path) => {
                let changed = self.folders[&self.folder_of(path)].pending.last();
                let name = changed.map_or("nothing", NameChange::name);
                Some(format!("name of {}", kind_of_name(name)))
            }
            _ => None,
        }
    }

    /// Returns true if a crash leaves everything.
    pub(crate) fn is_certain(&self) -> bool {
        self.folders.values().all(|names| names.pending.is_empty())
            && self.contents.values().all(|content| content.certain == content.present)
    }

    /// Writes what a crash leaves into an empty folder.
    pub(crate) fn write_remains(&self, crash: Crash, folder: &Path) {
        let seed = match crash {
            Crash::NamesAndTorn(seed) | Crash::Random(seed) => seed,
            _ => 0,
        };
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        self.write_folder(0, crash, &mut random, folder);
    }

    fn write_folder(&self, inode: usize, crash: Crash, random: &mut ChaCha8Rng, folder: &Path) {
        let names = &self.folders[&inode];
        let mut entries = names.certain.clone();
        for (at, change) in names.pending.iter().enumerate() {
            let is_left = match crash {
                Crash::Nothing | Crash::ContentOnly => false,
                Crash::Everything | Crash::NamesOnly | Crash::NamesAndTorn(_) => true,
                Crash::NewestName => at + 1 == names.pending.len(),
                Crash::Random(_) => random.next_u32().is_multiple_of(2),
            };
            if is_left {
                change.apply(&mut entries);
            }
        }
        for (name, node) in &entries {
            let path = folder.join(name);
            match node {
                Node::Folder(number) => {
                    fs::create_dir(&path).unwrap();
                    self.write_folder(*number, crash, random, &path);
                }
                Node::Link(target) => std::os::unix::fs::symlink(target, &path).unwrap(),
                Node::File(number) => {
                    fs::write(&path, remains(&self.contents[number], crash, random)).unwrap();
                }
            }
        }
    }
}

/// Returns what a crash leaves of a file.
fn remains(content: &Content, crash: Crash, random: &mut ChaCha8Rng) -> Vec<u8> {
    let Content { certain, present } = content;
    let is_torn = match crash {
        Crash::Nothing | Crash::NamesOnly => return certain.clone(),
        Crash::Everything | Crash::ContentOnly | Crash::NewestName => return present.clone(),
        Crash::NamesAndTorn(_) => true,
        Crash::Random(_) => match random.next_u32() % 3 {
            0 => return certain.clone(),
            1 => return present.clone(),
            _ => true,
        },
    };
    let same = certain.iter().zip(present).take_while(|(one, other)| one == other).count();
    let uncertain = present.len().saturating_sub(same);
    if !is_torn || uncertain == 0 {
        return present.clone();
    }
    let at = same + usize::try_from(random.next_u32()).unwrap() % uncertain;
    let at = (at / SECTOR * SECTOR).max(same);
    let mut torn = present[..at].to_vec();
    // The size may be there before the content.
    if random.next_u32().is_multiple_of(2) {
        torn.resize(present.len(), 0);
    }
    torn
}

/// Returns the kind of a file by its name: without numbers, hashes and random parts.
fn kind_of_name(name: &str) -> String {
    let name = name.strip_prefix('.').filter(|_| name.ends_with(".tmp")).unwrap_or(name);
    let name = match name.strip_suffix(".tmp").and_then(|name| name.rsplit_once('.')) {
        Some((replaced, _)) => replaced,
        None => name,
    };
    if name.len() == 64 {
        return "a configuration".to_owned();
    }
    name.chars().filter(|letter| !letter.is_ascii_digit()).collect()
}
