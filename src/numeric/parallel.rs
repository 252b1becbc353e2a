//! Work over several threads that cannot change a bit: every item is written by its index, and chunk lengths
//! are the caller's constants, never a function of the thread count (contract 3).
//!
//! Without the feature `threads` the same functions run on the caller's thread.

#[cfg(feature = "threads")]
use rayon::prelude::*;

/// Calls `work(index, chunk)` for each run of `length` items of `data` (the last may be shorter).
pub fn for_each_chunk<T: Send>(data: &mut [T], length: usize, work: impl Fn(usize, &mut [T]) + Sync) {
    #[cfg(feature = "threads")]
    data.par_chunks_mut(length).enumerate().for_each(|(index, chunk)| work(index, chunk));
    #[cfg(not(feature = "threads"))]
    data.chunks_mut(length).enumerate().for_each(|(index, chunk)| work(index, chunk));
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
