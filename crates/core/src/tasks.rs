//! Sharing out work over threads. A task is so many consecutive places, whatever the number of threads.

use rayon::prelude::*;

/// Calls `work` with the number and the places of every task of `size` places, on all threads where `parallel`.
///
/// What is called is not a type parameter: threads are then compiled once, and not for every law of force.
pub(crate) fn each<T: Send>(places: &mut [T], size: usize, parallel: bool, work: &(dyn Fn(usize, &mut [T]) + Sync)) {
    if parallel {
        places.par_chunks_mut(size).enumerate().for_each(|(task, places)| work(task, places));
    } else {
        places.chunks_mut(size).enumerate().for_each(|(task, places)| work(task, places));
    }
}
