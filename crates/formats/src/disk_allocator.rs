//! Memory beyond the free memory: files without a name, which the kernel writes and reads page by
//! page.
#![allow(unsafe_code, reason = "an allocator, and the mappings of files that it hands out")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::{self, ErrorKind};
use std::path::PathBuf;
use std::ptr::{self, NonNull};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use rustix::fs::{FallocateFlags, fallocate, statfs};
use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

use crate::free_memory::free_memory;

/// What is smaller stands in memory \[bytes\]: of a long record, next to nothing is.
const LARGE: usize = 1 << 17;
/// No more than a page, to which mappings are aligned \[bytes\].
const MOST_ALIGNED: usize = 4096;
/// File systems of memory (`linux/magic.h`).
const IN_MEMORY: [i64; 2] = [0x0102_1994, 0x8584_58f6];

/// Large allocations that may stand in memory, and that do \[bytes\].
static MOST: AtomicUsize = AtomicUsize::new(usize::MAX);
static ALLOCATED: AtomicUsize = AtomicUsize::new(0);
/// Where the files go, once they may.
static FOLDER: OnceLock<PathBuf> = OnceLock::new();
/// Where those begin that stand in files.
static IN_FILES: Mutex<Vec<usize>> = Mutex::new(Vec::new());

/// The system's allocator; once [`allow`](Self::allow) was called, large allocations for which too
/// little memory is free stand in files of `TMPDIR`, or of `/var/tmp` without one. They have no
/// name, and end with the process.
///
/// A program has it as its global allocator.
pub struct DiskAllocator;

impl DiskAllocator {
    /// Lets large allocations take three quarters of the memory that is free now, and what goes
    /// beyond stand in files.
    pub fn allow() {
        FOLDER.get_or_init(|| {
            let most = usize::try_from(free_memory() / 4 * 3).unwrap_or(usize::MAX);
            MOST.store(ALLOCATED.load(Relaxed).saturating_add(most), Relaxed);
            leave_no_holes();
            std::env::var_os("TMPDIR").map_or("/var/tmp".into(), PathBuf::from)
        });
    }

    /// What files may take \[bytes\]: nothing before they are allowed, or where the folder's file
    /// system is memory itself.
    pub(crate) fn capacity() -> u64 {
        let Some(of) = FOLDER.get().and_then(|folder| statfs(folder).ok()) else { return 0 };
        #[expect(clippy::unnecessary_cast, reason = "on other processors these are of other types")]
        let (kind, free_blocks) = (of.f_type as i64, of.f_bavail as u64);
        let block = u64::try_from(of.f_bsize).unwrap_or(0);
        if IN_MEMORY.contains(&kind) { 0 } else { free_blocks.saturating_mul(block) }
    }

    /// A large allocation, where there is room; `in_memory` is what the system would do.
    fn large(layout: Layout, in_memory: impl Fn() -> *mut u8) -> *mut u8 {
        let allocate = || {
            let memory = in_memory();
            ALLOCATED.fetch_add(if memory.is_null() { 0 } else { layout.size() }, Relaxed);
            memory
        };
        let fits = Self::fits(layout.size());
        let memory = if fits { allocate() } else { ptr::null_mut() };
        if !memory.is_null() {
            return memory;
        }
        match in_file(layout) {
            Ok(at) => at,
            Err(_) if fits => ptr::null_mut(),
            Err(_) => allocate(),
        }
    }

    fn fits(size: usize) -> bool {
        ALLOCATED.load(Relaxed).saturating_add(size) <= MOST.load(Relaxed)
    }
}

// SAFETY: memory is the system's, or a mapping of its own of at least the size, aligned to a page
// and zero; it is given back to where it is from.
unsafe impl GlobalAlloc for DiskAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's layout, as it is.
        let in_memory = || unsafe { System.alloc(layout) };
        if layout.size() < LARGE { in_memory() } else { Self::large(layout, in_memory) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's layout, as it is.
        let in_memory = || unsafe { System.alloc_zeroed(layout) };
        if layout.size() < LARGE { in_memory() } else { Self::large(layout, in_memory) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        if layout.size() >= LARGE {
            if forget(at) {
                // SAFETY: a whole mapping of this size, which nobody uses any more.
                let _ = unsafe { munmap(at.cast(), layout.size()) };
                return;
            }
            ALLOCATED.fetch_sub(layout.size(), Relaxed);
        }
        // SAFETY: it is the system's, of this layout.
        unsafe { System.dealloc(at, layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        let large = |size: usize| if size >= LARGE { size } else { 0 };
        let in_file = layout.size() >= LARGE && in_files().contains(&(at as usize));
        if !in_file && (size < LARGE || Self::fits(size.saturating_sub(large(layout.size())))) {
            // SAFETY: it is the system's, of this layout.
            let new_memory = unsafe { System.realloc(at, layout, size) };
            if !new_memory.is_null() {
                ALLOCATED.fetch_add(large(size), Relaxed);
                ALLOCATED.fetch_sub(large(layout.size()), Relaxed);
                return new_memory;
            }
        }
        // SAFETY: the caller has seen to it that size and alignment are a layout; both allocations
        // hold what is copied, and the old one is given back once.
        unsafe {
            let target = self.alloc(Layout::from_size_align_unchecked(size, layout.align()));
            if !target.is_null() {
                ptr::copy_nonoverlapping(at, target, size.min(layout.size()));
                self.dealloc(at, layout);
            }
            target
        }
    }
}

/// Lets the system's allocator place what is larger than 4 MiB apart from the rest, so that all of
/// it is free once it is given back, and keep up to 64 MiB at the end of the rest. By itself it
/// follows what is given back, and leaves holes.
#[cfg(target_env = "gnu")]
fn leave_no_holes() {
    // SAFETY: two settings, which it takes at any time.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, 4 << 20);
        libc::mallopt(libc::M_TRIM_THRESHOLD, 64 << 20);
    }
}

/// Other allocators have no such settings.
#[cfg(not(target_env = "gnu"))]
fn leave_no_holes() {}

/// Zeros in a file of its own. All of it is reserved: a disk that is full later would end the
/// process.
fn in_file(layout: Layout) -> io::Result<*mut u8> {
    let folder = FOLDER.get().filter(|_| layout.align() <= MOST_ALIGNED);
    let (file, size) = (tempfile::tempfile_in(folder.ok_or(ErrorKind::NotFound)?)?, layout.size());
    fallocate(&file, FallocateFlags::empty(), 0, size as u64)?;
    let access = ProtFlags::READ | ProtFlags::WRITE;
    // SAFETY: a new mapping, of a file that nobody else can open.
    let memory = unsafe { mmap(ptr::null_mut(), size, access, MapFlags::SHARED, &file, 0) }?;
    let memory = NonNull::new(memory).ok_or(ErrorKind::OutOfMemory)?;
    in_files().push(memory.as_ptr() as usize);
    Ok(memory.as_ptr().cast())
}

/// Whether it stands in a file; it is none of them any more. Where files were never allowed, as in
/// a service, nothing is locked.
fn forget(at: *mut u8) -> bool {
    if FOLDER.get().is_none() {
        return false;
    }
    let mut mapped = in_files();
    let position = mapped.iter().position(|own| *own == at as usize);
    position.is_some_and(|found| mapped.swap_remove(found) == at as usize)
}

/// What the vector itself takes is small.
fn in_files() -> MutexGuard<'static, Vec<usize>> {
    IN_FILES.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_room_in_memory_is_whole_wherever_it_moves() {
        let layout = |size| Layout::from_size_align(size, 8).unwrap();
        let is_in_file = |at: *mut u8| in_files().contains(&(at as usize));
        let files = || in_files().len();
        DiskAllocator::allow();
        MOST.store(3 * LARGE, Relaxed);
        // SAFETY: sizes are those of the layouts, and each allocation is given back once.
        unsafe {
            let small = DiskAllocator.alloc(layout(LARGE - 1));
            small.write_bytes(7, LARGE - 1);
            let in_memory = DiskAllocator.realloc(small, layout(LARGE - 1), 2 * LARGE);
            assert!(!is_in_file(in_memory));
            assert_eq!(ALLOCATED.load(Relaxed), 2 * LARGE);
            let zeros = DiskAllocator.alloc_zeroed(layout(3 * LARGE / 2));
            assert!(is_in_file(zeros), "3.5 of 3");
            assert!((0..3 * LARGE / 2).all(|k| *zeros.add(k) == 0));
            let in_file = DiskAllocator.realloc(in_memory, layout(2 * LARGE), 5 * LARGE);
            assert!(is_in_file(in_file));
            in_file.add(LARGE - 1).write_bytes(8, 4 * LARGE);
            let small = DiskAllocator.realloc(in_file, layout(5 * LARGE), LARGE);
            assert!(!is_in_file(small), "there is room again");
            assert!((0..LARGE).all(|k| *small.add(k) == if k < LARGE - 1 { 7 } else { 8 }));
            assert_eq!((files(), ALLOCATED.load(Relaxed)), (1, LARGE));
            DiskAllocator.dealloc(small, layout(LARGE));
            DiskAllocator.dealloc(zeros, layout(3 * LARGE / 2));
        }
        assert_eq!((files(), ALLOCATED.load(Relaxed)), (0, 0));
    }
}
