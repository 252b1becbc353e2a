//! Work over several threads that cannot change a bit: every item is written by its index, and chunk lengths
//! are the caller's constants, never a function of the thread count (contract 3).
//!
//! Without the feature `threads` the same functions run on the caller's thread.

use super::order::max;
#[cfg(feature = "threads")]
use rayon::prelude::*;
use std::mem::MaybeUninit;

/// Calls `work(index, chunk)` for each run of `length` items of `data` (the last may be shorter).
pub fn for_each_chunk<T: Send>(data: &mut [T], length: usize, work: impl Fn(usize, &mut [T]) + Sync) {
    #[cfg(feature = "threads")]
    data.par_chunks_mut(length).enumerate().for_each(|(index, chunk)| work(index, chunk));
    #[cfg(not(feature = "threads"))]
    data.chunks_mut(length).enumerate().for_each(|(index, chunk)| work(index, chunk));
}

/// `count` images of `each` items, one after the other. `work(image, run, items)` makes a run of `length`
/// items of one image (an image's last may be shorter), which are all `empty` before.
///
/// A run is emptied just before `work` gets it, by the same thread, while it is in the cache: emptying a
/// whole vector first costs as much as a cheap pass.
pub fn images<T: Copy + Send + Sync>(
    [count, each]: [usize; 2],
    length: usize,
    empty: T,
    work: impl Fn(usize, usize, &mut [T]) + Sync,
) -> Vec<T> {
    let mut all = Vec::with_capacity(count * each);
    for (image, items) in all.spare_capacity_mut()[..count * each].chunks_exact_mut(max(each, 1)).enumerate()
    {
        for_each_chunk(items, length, |run, items| {
            items.fill(MaybeUninit::new(empty));
            #[expect(unsafe_code, reason = "items that were just written, as such")]
            // SAFETY: every item was written, and T, being Copy, needs no drop.
            work(image, run, unsafe { &mut *(items as *mut [MaybeUninit<T>] as *mut [T]) });
        });
    }
    #[expect(unsafe_code, reason = "the vector's items were written in place")]
    // SAFETY: the runs of all images are all count · each items, and each was written.
    unsafe {
        all.set_len(count * each);
    }
    all
}

/// `(0..count).map(item)`, in order.
pub fn map<T: Send>(count: usize, item: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    #[cfg(feature = "threads")]
    return (0..count).into_par_iter().map(item).collect();
    #[cfg(not(feature = "threads"))]
    return (0..count).map(item).collect();
}

/// The most threads that [`with_threads`] starts.
#[cfg(feature = "threads")]
pub const MAX_THREADS: usize = 1024;

/// Runs `work` with `threads` threads (0: one for each core).
///
/// # Errors
/// More than [`MAX_THREADS`], and where the system refuses to start the threads.
#[cfg(feature = "threads")]
pub fn with_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<T, crate::Error> {
    if threads > MAX_THREADS {
        return Err(
            crate::Error::new(format!("{threads} threads")).remedy(format!("ask for at most {MAX_THREADS}"))
        );
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| {
        crate::Error::new(format!("cannot start {threads} threads: {error}")).remedy("ask for fewer")
    })?;
    Ok(pool.install(work))
}
