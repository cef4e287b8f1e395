//! Eight lanes on AVX2 and AVX-512. Values of these types exist only where `dispatch_at` has found the instruction set,
//! which makes their use safe.

use super::{Arithmetic, Bits, Eight, LANES, Lanes, Simd};
use crate::lanes;
use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Sub};

/// Proof that AVX2 is there.
#[derive(Clone, Copy)]
pub struct Avx2(pub(super) ());
/// Eight numbers in two registers.
#[derive(Clone, Copy)]
pub struct Double(__m256d, __m256d);
/// Proof that AVX-512 F and DQ, and AVX2, are there.
#[derive(Clone, Copy)]
pub struct Avx512(pub(super) ());
/// Eight numbers in one register.
#[derive(Clone, Copy)]
pub struct Wide(__m512d);

/// Columns of four records of four numbers.
///
/// # Safety
/// AVX must be there.
#[inline(always)]
unsafe fn transpose_four(r: [&[f64; 4]; 4]) -> [__m256d; 4] {
    // SAFETY: by the function's condition; loads are unaligned and within the records.
    unsafe {
        // Halves of two records in one register.
        macro_rules! pair {
            ($a:expr, $b:expr, $from:expr) => {
                _mm256_insertf128_pd::<1>(
                    _mm256_castpd128_pd256(_mm_loadu_pd($a.as_ptr().add($from))),
                    _mm_loadu_pd($b.as_ptr().add($from)),
                )
            };
        }
        let (xy_even, xy_odd) = (pair!(r[0], r[2], 0), pair!(r[1], r[3], 0));
        let (zw_even, zw_odd) = (pair!(r[0], r[2], 2), pair!(r[1], r[3], 2));
        [
            _mm256_unpacklo_pd(xy_even, xy_odd),
            _mm256_unpackhi_pd(xy_even, xy_odd),
            _mm256_unpacklo_pd(zw_even, zw_odd),
            _mm256_unpackhi_pd(zw_even, zw_odd),
        ]
    }
}

// SAFETY of all blocks below: a value of the type, or its proof, is there, hence the instruction set; loads and stores
// are unaligned and stay within the array.

impl Arithmetic for Avx2 {
    type F = Double;

    #[inline(always)]
    fn splat(self, x: f64) -> Double {
        unsafe { Double(_mm256_set1_pd(x), _mm256_set1_pd(x)) }
    }

    #[inline(always)]
    fn load(self, from: &Eight) -> Double {
        unsafe { Double(_mm256_loadu_pd(from.as_ptr()), _mm256_loadu_pd(from.as_ptr().add(4))) }
    }

    #[inline(always)]
    fn ln(self, x: Double) -> Double {
        lanes::ln(self, x)
    }

    #[inline(always)]
    fn exp(self, x: Double) -> Double {
        lanes::exp(self, x)
    }
}

impl Simd for Avx2 {
    type Single = Single<Avx2>;

    #[inline(always)]
    fn single(self) -> Single<Avx2> {
        Single(self)
    }

    #[inline(always)]
    fn narrow(self, x: Double) -> Narrow {
        unsafe { Narrow(_mm256_set_m128(_mm256_cvtpd_ps(x.1), _mm256_cvtpd_ps(x.0))) }
    }

    #[inline(always)]
    fn widen(self, x: Narrow) -> Double {
        unsafe {
            Double(_mm256_cvtps_pd(_mm256_castps256_ps128(x.0)), _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(x.0)))
        }
    }

    #[inline(always)]
    fn transpose(self, records: [&[f64; 4]; LANES]) -> [Double; 4] {
        let [a, b, c, d, e, f, g, h] = records;
        unsafe {
            let (low, high) = (transpose_four([a, b, c, d]), transpose_four([e, f, g, h]));
            [Double(low[0], high[0]), Double(low[1], high[1]), Double(low[2], high[2]), Double(low[3], high[3])]
        }
    }
}

/// Both halves of one or two values through an intrinsic.
macro_rules! halves {
    ($f:ident, $a:expr) => {
        unsafe { Double($f($a.0), $f($a.1)) }
    };
    ($f:ident, $a:expr, $b:expr) => {
        unsafe { Double($f($a.0, $b.0), $f($a.1, $b.1)) }
    };
}
/// The same through an intrinsic on integers.
macro_rules! integers {
    ($f:ident, $a:expr, $low:expr, $high:expr) => {
        unsafe {
            Double(
                _mm256_castsi256_pd($f(_mm256_castpd_si256($a.0), $low)),
                _mm256_castsi256_pd($f(_mm256_castpd_si256($a.1), $high)),
            )
        }
    };
}

operators! { Double,
    Add add = |a, b| halves!(_mm256_add_pd, a, b);
    Sub sub = |a, b| halves!(_mm256_sub_pd, a, b);
    Mul mul = |a, b| halves!(_mm256_mul_pd, a, b);
    Div div = |a, b| halves!(_mm256_div_pd, a, b);
}

impl Lanes for Double {
    type Mask = Double;

    #[inline(always)]
    fn store(self, to: &mut Eight) {
        unsafe {
            _mm256_storeu_pd(to.as_mut_ptr(), self.0);
            _mm256_storeu_pd(to.as_mut_ptr().add(4), self.1);
        }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        halves!(_mm256_sqrt_pd, self)
    }

    #[inline(always)]
    fn le(self, other: Self) -> Self {
        unsafe { Double(_mm256_cmp_pd::<_CMP_LE_OQ>(self.0, other.0), _mm256_cmp_pd::<_CMP_LE_OQ>(self.1, other.1)) }
    }

    #[inline(always)]
    fn keep(self, mask: Self) -> Self {
        halves!(_mm256_and_pd, self, mask)
    }

    #[inline(always)]
    fn select(self, mask: Self, other: Self) -> Self {
        unsafe { Double(_mm256_blendv_pd(other.0, self.0, mask.0), _mm256_blendv_pd(other.1, self.1, mask.1)) }
    }

    #[inline(always)]
    fn any(mask: Self) -> bool {
        unsafe { _mm256_movemask_pd(_mm256_or_pd(mask.0, mask.1)) != 0 }
    }

    #[inline(always)]
    fn bitmask(mask: Self) -> u32 {
        unsafe { _mm256_movemask_pd(mask.0) as u32 | (_mm256_movemask_pd(mask.1) as u32) << 4 }
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        halves!(_mm256_min_pd, self, other)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        halves!(_mm256_max_pd, self, other)
    }
}

impl Bits for Double {
    #[inline(always)]
    fn add_bits(self, other: Self) -> Self {
        integers!(_mm256_add_epi64, self, _mm256_castpd_si256(other.0), _mm256_castpd_si256(other.1))
    }

    #[inline(always)]
    fn sub_bits(self, other: Self) -> Self {
        integers!(_mm256_sub_epi64, self, _mm256_castpd_si256(other.0), _mm256_castpd_si256(other.1))
    }

    #[inline(always)]
    fn and_bits(self, other: Self) -> Self {
        halves!(_mm256_and_pd, self, other)
    }

    #[inline(always)]
    fn or_bits(self, other: Self) -> Self {
        halves!(_mm256_or_pd, self, other)
    }

    #[inline(always)]
    fn shift_down<const BY: u32>(self) -> Self {
        integers!(_mm256_srl_epi64, self, _mm_cvtsi32_si128(BY as i32), _mm_cvtsi32_si128(BY as i32))
    }

    #[inline(always)]
    fn shift_up<const BY: u32>(self) -> Self {
        integers!(_mm256_sll_epi64, self, _mm_cvtsi32_si128(BY as i32), _mm_cvtsi32_si128(BY as i32))
    }
}

impl Arithmetic for Avx512 {
    type F = Wide;

    #[inline(always)]
    fn splat(self, x: f64) -> Wide {
        unsafe { Wide(_mm512_set1_pd(x)) }
    }

    #[inline(always)]
    fn load(self, from: &Eight) -> Wide {
        unsafe { Wide(_mm512_loadu_pd(from.as_ptr())) }
    }

    #[inline(always)]
    fn ln(self, x: Wide) -> Wide {
        lanes::ln(self, x)
    }

    #[inline(always)]
    fn exp(self, x: Wide) -> Wide {
        lanes::exp(self, x)
    }
}

impl Simd for Avx512 {
    type Single = Single<Avx512>;

    #[inline(always)]
    fn single(self) -> Single<Avx512> {
        Single(self)
    }

    #[inline(always)]
    fn narrow(self, x: Wide) -> Narrow {
        unsafe { Narrow(_mm512_cvtpd_ps(x.0)) }
    }

    #[inline(always)]
    fn widen(self, x: Narrow) -> Wide {
        unsafe { Wide(_mm512_cvtps_pd(x.0)) }
    }

    #[inline(always)]
    fn transpose(self, records: [&[f64; 4]; LANES]) -> [Wide; 4] {
        let [a, b, c, d, e, f, g, h] = records;
        unsafe {
            let (low, high) = (transpose_four([a, b, c, d]), transpose_four([e, f, g, h]));
            [
                Wide(_mm512_insertf64x4::<1>(_mm512_castpd256_pd512(low[0]), high[0])),
                Wide(_mm512_insertf64x4::<1>(_mm512_castpd256_pd512(low[1]), high[1])),
                Wide(_mm512_insertf64x4::<1>(_mm512_castpd256_pd512(low[2]), high[2])),
                Wide(_mm512_insertf64x4::<1>(_mm512_castpd256_pd512(low[3]), high[3])),
            ]
        }
    }
}

operators! { Wide,
    Add add = |a, b| unsafe { Wide(_mm512_add_pd(a.0, b.0)) };
    Sub sub = |a, b| unsafe { Wide(_mm512_sub_pd(a.0, b.0)) };
    Mul mul = |a, b| unsafe { Wide(_mm512_mul_pd(a.0, b.0)) };
    Div div = |a, b| unsafe { Wide(_mm512_div_pd(a.0, b.0)) };
}

impl Wide {
    #[inline(always)]
    fn integers(self) -> __m512i {
        unsafe { _mm512_castpd_si512(self.0) }
    }

    #[inline(always)]
    fn of(integers: __m512i) -> Self {
        unsafe { Wide(_mm512_castsi512_pd(integers)) }
    }
}

impl Lanes for Wide {
    type Mask = __mmask8;

    #[inline(always)]
    fn store(self, to: &mut Eight) {
        unsafe { _mm512_storeu_pd(to.as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        unsafe { Wide(_mm512_sqrt_pd(self.0)) }
    }

    #[inline(always)]
    fn le(self, other: Self) -> __mmask8 {
        unsafe { _mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, other.0) }
    }

    #[inline(always)]
    fn keep(self, mask: __mmask8) -> Self {
        unsafe { Wide(_mm512_maskz_mov_pd(mask, self.0)) }
    }

    #[inline(always)]
    fn select(self, mask: __mmask8, other: Self) -> Self {
        unsafe { Wide(_mm512_mask_blend_pd(mask, other.0, self.0)) }
    }

    #[inline(always)]
    fn any(mask: __mmask8) -> bool {
        mask != 0
    }

    #[inline(always)]
    fn bitmask(mask: __mmask8) -> u32 {
        u32::from(mask)
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        unsafe { Wide(_mm512_min_pd(self.0, other.0)) }
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        unsafe { Wide(_mm512_max_pd(self.0, other.0)) }
    }
}

impl Bits for Wide {
    #[inline(always)]
    fn add_bits(self, other: Self) -> Self {
        unsafe { Self::of(_mm512_add_epi64(self.integers(), other.integers())) }
    }

    #[inline(always)]
    fn sub_bits(self, other: Self) -> Self {
        unsafe { Self::of(_mm512_sub_epi64(self.integers(), other.integers())) }
    }

    #[inline(always)]
    fn and_bits(self, other: Self) -> Self {
        unsafe { Self::of(_mm512_and_si512(self.integers(), other.integers())) }
    }

    #[inline(always)]
    fn or_bits(self, other: Self) -> Self {
        unsafe { Self::of(_mm512_or_si512(self.integers(), other.integers())) }
    }

    #[inline(always)]
    fn shift_down<const BY: u32>(self) -> Self {
        unsafe { Self::of(_mm512_srli_epi64::<BY>(self.integers())) }
    }

    #[inline(always)]
    fn shift_up<const BY: u32>(self) -> Self {
        unsafe { Self::of(_mm512_slli_epi64::<BY>(self.integers())) }
    }
}

/// Arithmetic of 32 bits, with proof that AVX2 is there.
#[derive(Clone, Copy)]
pub struct Single<S>(S);
/// Eight numbers of 32 bits in one register of 256.
#[derive(Clone, Copy)]
pub struct Narrow(__m256);

impl<S: Simd<Single = Self>> Arithmetic for Single<S> {
    type F = Narrow;

    #[inline(always)]
    fn splat(self, x: f64) -> Narrow {
        unsafe { Narrow(_mm256_set1_ps(x as f32)) }
    }

    #[inline(always)]
    fn load(self, from: &Eight) -> Narrow {
        self.0.narrow(self.0.load(from))
    }

    #[inline(always)]
    fn ln(self, x: Narrow) -> Narrow {
        self.0.narrow(self.0.ln(self.0.widen(x)))
    }

    #[inline(always)]
    fn exp(self, x: Narrow) -> Narrow {
        self.0.narrow(self.0.exp(self.0.widen(x)))
    }
}

operators! { Narrow,
    Add add = |a, b| unsafe { Narrow(_mm256_add_ps(a.0, b.0)) };
    Sub sub = |a, b| unsafe { Narrow(_mm256_sub_ps(a.0, b.0)) };
    Mul mul = |a, b| unsafe { Narrow(_mm256_mul_ps(a.0, b.0)) };
    Div div = |a, b| unsafe { Narrow(_mm256_div_ps(a.0, b.0)) };
}

impl Lanes for Narrow {
    type Mask = __m256;

    #[inline(always)]
    fn store(self, to: &mut Eight) {
        unsafe {
            _mm256_storeu_pd(to.as_mut_ptr(), _mm256_cvtps_pd(_mm256_castps256_ps128(self.0)));
            _mm256_storeu_pd(to.as_mut_ptr().add(4), _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(self.0)));
        }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        unsafe { Narrow(_mm256_sqrt_ps(self.0)) }
    }

    #[inline(always)]
    fn le(self, other: Self) -> __m256 {
        unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0) }
    }

    #[inline(always)]
    fn keep(self, mask: __m256) -> Self {
        unsafe { Narrow(_mm256_and_ps(self.0, mask)) }
    }

    #[inline(always)]
    fn select(self, mask: __m256, other: Self) -> Self {
        unsafe { Narrow(_mm256_blendv_ps(other.0, self.0, mask)) }
    }

    #[inline(always)]
    fn any(mask: __m256) -> bool {
        unsafe { _mm256_movemask_ps(mask) != 0 }
    }

    #[inline(always)]
    fn bitmask(mask: __m256) -> u32 {
        unsafe { _mm256_movemask_ps(mask) as u32 }
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        unsafe { Narrow(_mm256_min_ps(self.0, other.0)) }
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        unsafe { Narrow(_mm256_max_ps(self.0, other.0)) }
    }
}
