//! How much memory is held, and a limit to it (`--max-memory`) for what a scene's size decides: loading and set-up.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::path::Path;
use std::ptr::null_mut;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// The system's allocator, which counts what is held; for the `abbe` command. Where the limit would be passed, or the system has no more, the process
/// ends, as an allocation cannot fail otherwise: by what [`at_limit`] was given, or else it is aborted.
#[derive(Debug)]
pub struct Counted;

static HELD: AtomicU64 = AtomicU64::new(0);
static LIMIT: AtomicU64 = AtomicU64::new(u64::MAX);
static AT_LIMIT: OnceLock<fn(Lack) -> !> = OnceLock::new();

thread_local! {
    /// Whoever allocates takes no for an answer.
    static MAY_FAIL: Cell<bool> = const { Cell::new(false) };
}

/// What an allocation failed for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lack {
    /// It would pass the limit, of so many bytes.
    Limit(u64),
    /// The system does not have so many bytes.
    System(u64),
}

/// Says how the process ends where an allocation fails. The limit is lifted by then. Only the first call counts.
pub fn at_limit(end: fn(Lack) -> !) {
    let _ = AT_LIMIT.set(end);
}

/// From here on no more than so many bytes may be held, or as many as there are.
pub fn limit(bytes: Option<u64>) {
    LIMIT.store(bytes.unwrap_or(u64::MAX), Relaxed);
}

/// Counts bytes that an adapter is to hold, while there is a limit.
pub(crate) fn count_on_adapter(bytes: u64) {
    if LIMIT.load(Relaxed) != u64::MAX {
        let _ = count(bytes);
    }
}

/// Counts bytes; false if they are too many for whoever takes no for an answer.
fn count(bytes: u64) -> bool {
    let held = HELD.fetch_add(bytes, Relaxed) + bytes;
    let most = LIMIT.load(Relaxed);
    if held <= most {
        return true;
    }
    if MAY_FAIL.get() {
        HELD.fetch_sub(bytes, Relaxed);
        return false;
    }
    fail(Lack::Limit(most));
    true
}

fn fail(lack: Lack) {
    // Saying it takes some memory, too.
    limit(None);
    AT_LIMIT.get().map_or_else(|| std::process::abort(), |end| end(lack))
}

/// The memory that the system gave, if it did.
fn given(memory: *mut u8, bytes: usize) -> *mut u8 {
    if memory.is_null() && AT_LIMIT.get().is_some() && !MAY_FAIL.get() {
        fail(Lack::System(bytes as u64));
    }
    memory
}

/// Whether the system has so many bytes more; they are given back.
pub fn can_have(bytes: u64) -> bool {
    let before = MAY_FAIL.replace(true);
    let mut probe = Vec::<u8>::new();
    let is_there = usize::try_from(bytes).is_ok_and(|bytes| probe.try_reserve_exact(bytes).is_ok());
    MAY_FAIL.set(before);
    is_there
}

/// Bytes that this process may come to hold: what the machine has or, where that is less, what the container or service is given that it runs in (control
/// groups of Linux, versions 1 and 2). `None` where it is not known.
pub fn of_machine() -> Option<u64> {
    of_system(Path::new("/"))
}

/// Likewise, by the files below `root`.
fn of_system(root: &Path) -> Option<u64> {
    let read = |path: &Path| std::fs::read_to_string(path).ok();
    let number = |path: &Path| read(path)?.trim().parse::<u64>().ok();
    let groups = read(&root.join("proc/self/cgroup")).unwrap_or_default();
    // A line is "number:controllers:/path"; that of version 2 has no controllers. A container may see its own group as the root.
    let limits = groups.lines().flat_map(|line| {
        let mut parts = line.splitn(3, ':').skip(1);
        let (controllers, path) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
        let (folder, file) = match controllers {
            "" => ("sys/fs/cgroup", "memory.max"),
            _ => ("sys/fs/cgroup/memory", "memory.limit_in_bytes"),
        };
        let counts = controllers.is_empty() || controllers.split(',').any(|c| c == "memory");
        let paths = Path::new(path.trim_start_matches('/')).ancestors().filter(move |_| counts);
        paths.filter_map(move |path| number(&root.join(folder).join(path).join(file))).collect::<Vec<_>>()
    });
    let all = read(&root.join("proc/meminfo")).and_then(|text| {
        let line = text.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
        Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
    });
    limits.chain(all).min()
}

// SAFETY: all memory comes from and goes back to the system's allocator, with the layouts as given.
unsafe impl GlobalAlloc for Counted {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if count(layout.size() as u64) { given(unsafe { System.alloc(layout) }, layout.size()) } else { null_mut() }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if count(layout.size() as u64) { given(unsafe { System.alloc_zeroed(layout) }, layout.size()) } else { null_mut() }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size() as u64, Relaxed);
        unsafe { System.dealloc(memory, layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        if !count(size as u64) {
            return null_mut();
        }
        HELD.fetch_sub(layout.size() as u64, Relaxed);
        given(unsafe { System.realloc(memory, layout, size) }, size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_container_has_what_its_control_group_is_given() {
        let root = std::env::temp_dir().join(format!("abbe-memory-{}", std::process::id()));
        let put = |path: &str, text: &str| {
            let path = root.join(path);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        put("proc/meminfo", "MemTotal:       16384 kB\nMemFree:         1024 kB\n");
        assert_eq!(of_system(&root), Some(16 << 20));
        // Version 2: the group or one that it is in.
        put("proc/self/cgroup", "0::/pod/box\n");
        put("sys/fs/cgroup/pod/box/memory.max", "max\n");
        assert_eq!(of_system(&root), Some(16 << 20));
        put("sys/fs/cgroup/pod/memory.max", "8388608\n");
        assert_eq!(of_system(&root), Some(8 << 20));
        // Version 1, of which a container sees its own group as the root.
        put("proc/self/cgroup", "5:cpu,cpuacct:/docker/1\n4:memory:/docker/1\n");
        put("sys/fs/cgroup/memory/memory.limit_in_bytes", "4194304\n");
        assert_eq!(of_system(&root), Some(4 << 20));
        // No limit is a number beyond all memory there.
        put("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
        assert_eq!(of_system(&root), Some(16 << 20));
        std::fs::remove_dir_all(&root).unwrap();
    }
}
