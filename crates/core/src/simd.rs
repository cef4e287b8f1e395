//! Eight lanes of f64 on the best instruction set of the machine; the only place with `unsafe` code.
//!
//! A [`Kernel`] is written once over the operations of [`Lanes`] and compiled for AVX-512, AVX2 and plain code (which is
//! what NEON runs). All of these operations are exact or correctly rounded everywhere (no fused multiply-add, no
//! approximate reciprocal), and lanes are eight on every machine, so all instruction sets give the same bits. A [`Task`]
//! is plain code that the compiler puts into vectors by itself, under the same rules.

/// Implements the operators of a vector type by four functions.
macro_rules! operators {
    ($name:ty, $($operator:ident $function:ident = |$a:ident, $b:ident| $value:expr;)*) => {
        $(impl $operator for $name {
            type Output = Self;

            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                let ($a, $b) = (self, other);
                $value
            }
        })*
    };
}

mod portable;
#[cfg(target_arch = "x86_64")]
mod x86;

use portable::Portable;
use std::ops::{Add, Div, Mul, Sub};
use std::sync::atomic::{AtomicU8, Ordering};

/// Lanes that sums are kept in, the same on every instruction set.
pub const LANES: usize = 8;
/// One number for each lane.
pub type Eight = [f64; LANES];

/// Eight numbers at an address that no vector straddles a cache line from: columns of these are read and written about
/// a third faster.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub struct Block(pub Eight);

/// A column in whole blocks, with zeros behind the last number.
#[must_use]
pub fn blocks(column: &[f64]) -> Vec<Block> {
    let mut blocks = vec![Block::default(); column.len().div_ceil(LANES)];
    fill(&mut blocks, column);
    blocks
}

/// Copies a column into blocks.
pub fn fill(blocks: &mut [Block], column: &[f64]) {
    let (whole, rest) = column.as_chunks::<LANES>();
    for (block, eight) in blocks.iter_mut().zip(whole) {
        block.0 = *eight;
    }
    if let Some(block) = blocks.get_mut(whole.len()) {
        block.0[..rest.len()].copy_from_slice(rest);
    }
}

/// Instruction sets, from the one that every machine has to the widest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// What the target has at least: SSE2 on x86-64, NEON on 64-bit Arm.
    Portable,
    /// 256-bit vectors of x86-64.
    Avx2,
    /// 512-bit vectors of x86-64.
    Avx512,
}

/// Every level, narrowest first.
pub const LEVELS: [Level; 3] = [Level::Portable, Level::Avx2, Level::Avx512];

/// What the program is limited to, as an index into [`LEVELS`].
static LIMIT: AtomicU8 = AtomicU8::new(LEVELS.len() as u8 - 1);

impl Level {
    /// Whether this machine can run it.
    #[must_use]
    pub fn available(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                is_x86_feature_detected!("avx2")
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512dq")
            }
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => false,
        }
    }

    /// The widest that the machine has, and that [`limit`] allows.
    #[must_use]
    pub fn current() -> Self {
        let limit = LEVELS[usize::from(LIMIT.load(Ordering::Relaxed))];
        LEVELS.into_iter().rev().find(|&level| level <= limit && level.available()).unwrap_or(Self::Portable)
    }
}

/// Keeps the whole program from using wider instruction sets. Results do not depend on it; it exists to show that.
pub fn limit(level: Level) {
    LIMIT.store(level as u8, Ordering::Relaxed);
}

/// Code over eight lanes, compiled once per instruction set. Mark `run`, and what it calls in hot loops,
/// `#[inline(always)]`: only what is inlined is compiled for the instruction set.
pub trait Kernel {
    /// What it gives.
    type Output;
    /// Does it.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Plain code to be compiled once per instruction set; `#[inline(always)]` as for a [`Kernel`].
pub trait Task {
    /// What it gives.
    type Output;
    /// Does it.
    fn run(self) -> Self::Output;
}

/// A task as a kernel that leaves lanes to the compiler.
struct Plain<T>(T);

impl<T: Task> Kernel for Plain<T> {
    type Output = T::Output;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> T::Output {
        self.0.run()
    }
}

/// Runs a task with the widest vectors that this machine has.
pub fn vectorized<T: Task>(task: T) -> T::Output {
    dispatch_at(Level::current(), Plain(task))
}

/// Runs a kernel with the widest vectors that this machine has.
pub fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    dispatch_at(Level::current(), kernel)
}

/// Runs a kernel on one level, or on plain code where the machine does not have that level.
pub fn dispatch_at<K: Kernel>(level: Level, kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx512f,avx512dq,avx2")]
        fn avx512<K: Kernel>(kernel: K) -> K::Output {
            kernel.run(x86::Avx512(()))
        }
        #[target_feature(enable = "avx2")]
        fn avx2<K: Kernel>(kernel: K) -> K::Output {
            kernel.run(x86::Avx2(()))
        }
        if level == Level::Avx512 && level.available() {
            // SAFETY: the features were found on this machine.
            return unsafe { avx512(kernel) };
        }
        if level == Level::Avx2 && level.available() {
            // SAFETY: the feature was found on this machine.
            return unsafe { avx2(kernel) };
        }
    }
    _ = level;
    kernel.run(Portable)
}

/// Arithmetic of one precision on an instruction set that this machine has; makes [`Lanes`].
pub trait Arithmetic: Copy {
    /// Its eight numbers.
    type F: Lanes;
    /// The same number in every lane.
    fn splat(self, x: f64) -> Self::F;
    /// Eight consecutive numbers.
    fn load(self, from: &Eight) -> Self::F;
    /// Natural logarithm of positive, finite, normal numbers.
    fn ln(self, x: Self::F) -> Self::F;
    /// Exponential.
    fn exp(self, x: Self::F) -> Self::F;
}

/// Arithmetic of 64 bits, and a way to that of 32 and back.
pub trait Simd: Arithmetic<F: Bits> {
    /// Arithmetic of 32 bits.
    type Single: Arithmetic;
    /// It.
    fn single(self) -> Self::Single;
    /// Rounds to 32 bits.
    fn narrow(self, x: Self::F) -> <Self::Single as Arithmetic>::F;
    /// The same numbers in 64 bits.
    fn widen(self, x: <Self::Single as Arithmetic>::F) -> Self::F;
    /// Eight records of four numbers, as four vectors of their first, second, third and fourth.
    fn transpose(self, records: [&[f64; 4]; LANES]) -> [Self::F; 4];
    /// The same bits in every lane.
    #[inline(always)]
    fn bits(self, bits: u64) -> Self::F {
        self.splat(f64::from_bits(bits))
    }
}

/// Eight numbers. Comparisons with a NaN are false.
pub trait Lanes: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> {
    /// True or false for every lane.
    type Mask: Copy;
    /// Writes all lanes.
    fn store(self, to: &mut Eight);
    /// Square root.
    fn sqrt(self) -> Self;
    /// Where `self <= other`.
    fn le(self, other: Self) -> Self::Mask;
    /// The lanes of a mask; zero, also for a NaN, in all others.
    fn keep(self, mask: Self::Mask) -> Self;
    /// The lanes of a mask from `self`, all others from `other`.
    fn select(self, mask: Self::Mask, other: Self) -> Self;
    /// Whether any lane is true.
    fn any(mask: Self::Mask) -> bool;
    /// Bit k is set where lane k is true.
    fn bitmask(mask: Self::Mask) -> u32;
    /// `self` where it is smaller, else `other`.
    fn min(self, other: Self) -> Self;
    /// `self` where it is larger, else `other`.
    fn max(self, other: Self) -> Self;
    /// All lanes, in order.
    #[inline(always)]
    fn to_array(self) -> Eight {
        let mut out = [0.0; LANES];
        self.store(&mut out);
        out
    }
    /// Lanes to one number, always in this order.
    #[inline(always)]
    fn sum(self) -> f64 {
        sum(&self.to_array())
    }
}

/// Eight numbers of 64 bits, as their bits.
pub trait Bits: Lanes {
    /// Adds as 64-bit integers, wrapping.
    fn add_bits(self, other: Self) -> Self;
    /// Subtracts as 64-bit integers, wrapping.
    fn sub_bits(self, other: Self) -> Self;
    /// Bits in both.
    fn and_bits(self, other: Self) -> Self;
    /// Bits in either.
    fn or_bits(self, other: Self) -> Self;
    /// Shifts to lower bits, zeros come in.
    fn shift_down<const BY: u32>(self) -> Self;
    /// Shifts to higher bits, zeros come in.
    fn shift_up<const BY: u32>(self) -> Self;
}

/// Lanes to one number, always in this order.
#[inline(always)]
#[must_use]
pub fn sum(lane: &Eight) -> f64 {
    ((lane[0] + lane[1]) + (lane[2] + lane[3])) + ((lane[4] + lane[5]) + (lane[6] + lane[7]))
}
