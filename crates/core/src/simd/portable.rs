//! Eight lanes in plain code, for every machine.

use super::{Eight, LANES, Lanes, Simd};
use std::ops::{Add, Div, Mul, Sub};

/// Plain code.
#[derive(Clone, Copy, Debug)]
pub struct Portable;

/// Eight numbers in plain code.
#[derive(Clone, Copy, Debug)]
pub struct PortableLanes(Eight);

impl PortableLanes {
    #[inline(always)]
    fn map(mut self, f: impl Fn(f64) -> f64) -> Self {
        for k in 0..LANES {
            self.0[k] = f(self.0[k]);
        }
        self
    }

    #[inline(always)]
    fn zip(mut self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        for k in 0..LANES {
            self.0[k] = f(self.0[k], other.0[k]);
        }
        self
    }

    #[inline(always)]
    fn zip_bits(self, other: Self, f: impl Fn(u64, u64) -> u64) -> Self {
        self.zip(other, |a, b| f64::from_bits(f(a.to_bits(), b.to_bits())))
    }
}

impl Simd for Portable {
    type F = PortableLanes;

    #[inline(always)]
    fn splat(self, x: f64) -> PortableLanes {
        PortableLanes([x; LANES])
    }

    #[inline(always)]
    fn load(self, from: &Eight) -> PortableLanes {
        PortableLanes(*from)
    }

    #[inline(always)]
    fn transpose(self, records: [&[f64; 4]; LANES]) -> [PortableLanes; 4] {
        let mut columns = [PortableLanes([0.0; LANES]); 4];
        for k in 0..LANES {
            for (column, value) in columns.iter_mut().zip(records[k]) {
                column.0[k] = *value;
            }
        }
        columns
    }
}

operators! { PortableLanes,
    Add add = |a, b| a.zip(b, |a, b| a + b);
    Sub sub = |a, b| a.zip(b, |a, b| a - b);
    Mul mul = |a, b| a.zip(b, |a, b| a * b);
    Div div = |a, b| a.zip(b, |a, b| a / b);
}

impl Lanes for PortableLanes {
    type Mask = [bool; LANES];

    #[inline(always)]
    fn store(self, to: &mut Eight) {
        *to = self.0;
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(f64::sqrt)
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
        self.select(mask, Self([0.0; LANES]))
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
