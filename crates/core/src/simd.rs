//! Runs a task compiled for the best instruction set of the machine; the only file with `unsafe` code.
//!
//! A task is plain code over fixed lanes. It contains no operation that differs between instruction sets (no
//! contraction into fused multiply-add, no approximate reciprocal), so all of them give the same bits.

/// Code to be compiled once per instruction set. Mark `run`, and what it calls in hot loops, `#[inline(always)]`:
/// only what is inlined is compiled for the instruction set.
pub trait Task {
    /// What it gives.
    type Output;
    /// Does it.
    fn run(self) -> Self::Output;
}

/// Runs a task with the widest vectors that this machine has.
pub fn vectorized<T: Task>(task: T) -> T::Output {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx512f,avx512dq")]
        fn avx512<T: Task>(task: T) -> T::Output {
            task.run()
        }
        #[target_feature(enable = "avx2")]
        fn avx2<T: Task>(task: T) -> T::Output {
            task.run()
        }
        if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq") {
            // SAFETY: both features were found on this machine.
            return unsafe { avx512(task) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the feature was found on this machine.
            return unsafe { avx2(task) };
        }
    }
    task.run()
}
