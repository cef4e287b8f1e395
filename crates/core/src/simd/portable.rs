//! Eight lanes in plain code, for every machine.

use super::{Arithmetic, Bits, Eight, LANES, Lanes, Simd};
use crate::lanes;
use std::ops::{Add, Div, Mul, Sub};

/// Plain code.
#[derive(Clone, Copy, Debug)]
pub struct Portable;
/// Plain code for 32 bits.
#[derive(Clone, Copy, Debug)]
pub struct PortableSingle;

/// Eight numbers in plain code.
#[derive(Clone, Copy, Debug)]
pub struct PortableLanes<T>([T; LANES]);

/// A number of 64 or 32 bits.
pub trait Number:
    Copy
    + Default
    + PartialOrd
    + Into<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
{
    /// Square root.
    fn root(self) -> Self;
}

impl Number for f64 {
    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }
}

impl Number for f32 {
    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }
}

impl<T: Number> PortableLanes<T> {
    #[inline(always)]
    fn map(mut self, f: impl Fn(T) -> T) -> Self {
        for k in 0..LANES {
            self.0[k] = f(self.0[k]);
        }
        self
    }

    #[inline(always)]
    fn zip(mut self, other: Self, f: impl Fn(T, T) -> T) -> Self {
        for k in 0..LANES {
            self.0[k] = f(self.0[k], other.0[k]);
        }
        self
    }
}

impl PortableLanes<f64> {
    #[inline(always)]
    fn zip_bits(self, other: Self, f: impl Fn(u64, u64) -> u64) -> Self {
        self.zip(other, |a, b| f64::from_bits(f(a.to_bits(), b.to_bits())))
    }
}

impl Arithmetic for Portable {
    type F = PortableLanes<f64>;

    #[inline(always)]
    fn splat(self, x: f64) -> PortableLanes<f64> {
        PortableLanes([x; LANES])
    }

    #[inline(always)]
    fn load(self, from: &Eight) -> PortableLanes<f64> {
        PortableLanes(*from)
    }

    #[inline(always)]
    fn ln(self, x: PortableLanes<f64>) -> PortableLanes<f64> {
        lanes::ln(self, x)
    }

    #[inline(always)]
    fn exp(self, x: PortableLanes<f64>) -> PortableLanes<f64> {
        lanes::exp(self, x)
    }
}

impl Simd for Portable {
    type Single = PortableSingle;

    #[inline(always)]
    fn single(self) -> PortableSingle {
        PortableSingle
    }

    #[inline(always)]
    fn narrow(self, x: PortableLanes<f64>) -> PortableLanes<f32> {
        let mut narrow = [0.0; LANES];
        for k in 0..LANES {
            narrow[k] = x.0[k] as f32;
        }
        PortableLanes(narrow)
    }

    #[inline(always)]
    fn widen(self, x: PortableLanes<f32>) -> PortableLanes<f64> {
        PortableLanes(x.to_array())
    }

    #[inline(always)]
    fn transpose(self, records: [&[f64; 4]; LANES]) -> [PortableLanes<f64>; 4] {
        let mut columns = [PortableLanes([0.0; LANES]); 4];
        for k in 0..LANES {
            for (column, value) in columns.iter_mut().zip(records[k]) {
                column.0[k] = *value;
            }
        }
        columns
    }
}

impl Arithmetic for PortableSingle {
    type F = PortableLanes<f32>;

    #[inline(always)]
    fn splat(self, x: f64) -> PortableLanes<f32> {
        PortableLanes([x as f32; LANES])
    }

    #[inline(always)]
    fn load(self, from: &Eight) -> PortableLanes<f32> {
        Portable.narrow(Portable.load(from))
    }

    #[inline(always)]
    fn ln(self, x: PortableLanes<f32>) -> PortableLanes<f32> {
        Portable.narrow(Portable.ln(Portable.widen(x)))
    }

    #[inline(always)]
    fn exp(self, x: PortableLanes<f32>) -> PortableLanes<f32> {
        Portable.narrow(Portable.exp(Portable.widen(x)))
    }
}

/// Operators that are those of the numbers.
macro_rules! each {
    ($($operator:ident $function:ident $symbol:tt)*) => {
        $(impl<T: Number> $operator for PortableLanes<T> {
            type Output = Self;

            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                self.zip(other, |a, b| a $symbol b)
            }
        })*
    };
}
each! { Add add + Sub sub - Mul mul * Div div / }

impl<T: Number> Lanes for PortableLanes<T> {
    type Mask = [bool; LANES];

    #[inline(always)]
    fn store(self, to: &mut Eight) {
        for k in 0..LANES {
            to[k] = self.0[k].into();
        }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(T::root)
    }

    #[inline(always)]
    fn le(self, other: Self) -> [bool; LANES] {
        let mut mask = [false; LANES];
        for k in 0..LANES {
            mask[k] = self.0[k] <= other.0[k];
        }
        mask
    }

    #[inline(always)]
    fn keep(self, mask: [bool; LANES]) -> Self {
        self.select(mask, Self([T::default(); LANES]))
    }

    #[inline(always)]
    fn select(mut self, mask: [bool; LANES], other: Self) -> Self {
        for k in 0..LANES {
            self.0[k] = if mask[k] { self.0[k] } else { other.0[k] };
        }
        self
    }

    #[inline(always)]
    fn any(mask: [bool; LANES]) -> bool {
        mask.contains(&true)
    }

    #[inline(always)]
    fn bitmask(mask: [bool; LANES]) -> u32 {
        let mut bits = 0;
        for k in 0..LANES {
            bits |= u32::from(mask[k]) << k;
        }
        bits
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
}

impl Bits for PortableLanes<f64> {
    #[inline(always)]
    fn add_bits(self, other: Self) -> Self {
        self.zip_bits(other, u64::wrapping_add)
    }

    #[inline(always)]
    fn sub_bits(self, other: Self) -> Self {
        self.zip_bits(other, u64::wrapping_sub)
    }

    #[inline(always)]
    fn and_bits(self, other: Self) -> Self {
        self.zip_bits(other, |a, b| a & b)
    }

    #[inline(always)]
    fn or_bits(self, other: Self) -> Self {
        self.zip_bits(other, |a, b| a | b)
    }

    #[inline(always)]
    fn shift_down<const BY: u32>(self) -> Self {
        self.map(|x| f64::from_bits(x.to_bits() >> BY))
    }

    #[inline(always)]
    fn shift_up<const BY: u32>(self) -> Self {
        self.map(|x| f64::from_bits(x.to_bits() << BY))
    }
}
