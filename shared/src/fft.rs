//! Fixed-point Fourier transform of real samples: 32-bit data, Q31 twiddle factors, one block exponent.
//!
//! Forward transform, X\[k\] = Σ x\[n\]·exp(−2πi·k·n/N), of N = 256 … 4096 real values, in place.
//!
//! The N real values are taken as N/2 complex ones, sorted into bit-reversed order, transformed by
//! one pass of multiplication-free butterflies (radix 4, or radix 8 where N/2 is no power of four), radix-4
//! passes with twiddle factors, and split into the spectrum of the real values.
//!
//! **Scaling.** The input is shifted once, as a block, so that its largest value has just the room that the transform
//! needs; no later pass looks at the data. A product with a Q31 factor keeps the high word, which halves it; the
//! one leg of a radix-4 butterfly that has no factor is halved to match. So each radix-4 pass with factors grows a tone by two and white
//! noise not at all, and the result of every size ends just below 2³¹.
//!
//! **Why nothing overflows.** With M = 2^(31+p)/N, p the number of radix-4 passes with factors, the input lies in −M … M−1.
//! 1. Before a pass of span L every complex value is a sum of L/4 packed inputs of modulus ≤ √2·M times unit factors, halved in each of the
//!    earlier passes; after the last pass |Z| ≤ √2·(N/2)·M/2^p = 2³⁰·√2 < 2³¹. Inside a butterfly the partial
//!    sums are sums over fewer inputs with the same weights, hence smaller.
//! 2. The split forms Z\[k\] ± Z*\[N/2−k\], twice the transform of the even or the odd samples:
//!    ≤ 2·(N/2)·M/2^p·c, c the mean of |cos| over the sampled phases. c = 1 only for k = 0, which is treated apart; for all other
//!    k it is at most √½ (four phases per turn), hence ≤ 2³¹·√½.
//! 3. |X\[k\]| ≤ N·M/2^p·√½ = 2³¹·√½ for the same reason, and for X\[0\] and X\[N/2\] ≤ 2³¹, attained by a block of −M;
//!    these two sums saturate.
//!
//! Rounding adds less than 2^p·8 units to any of these, far inside the margins of 1 to 3.

/// Complex number with integer parts: real, imaginary.
pub type Complex = [i32; 2];

/// High word of a product, rounded: a·b/2³². With b in Q31 that is half the product.
#[inline(always)]
fn multiply(a: i32, b: i32) -> i32 {
    ((a as i64 * b as i64 + 0x8000_0000) >> 32) as i32
}

/// `sum` + a·b/2³², rounded.
#[inline(always)]
fn multiply_add(sum: i32, a: i32, b: i32) -> i32 {
    ((((sum as i64) << 32) + a as i64 * b as i64 + 0x8000_0000) >> 32) as i32
}

/// `sum` − a·b/2³², rounded.
#[inline(always)]
fn multiply_subtract(sum: i32, a: i32, b: i32) -> i32 {
    ((((sum as i64) << 32) + 0x8000_0000 - a as i64 * b as i64) >> 32) as i32
}

/// Half the product of z and exp(−iφ), given as \[cos φ, sin φ\] in Q31.
#[inline(always)]
fn turn(z: Complex, factor: Complex) -> Complex {
    let [cos, sin] = factor;
    [
        multiply_add(multiply(z[0], cos), z[1], sin),
        multiply_subtract(multiply(z[1], cos), z[0], sin),
    ]
}

#[inline(always)]
fn add(a: Complex, b: Complex) -> Complex {
    [a[0] + b[0], a[1] + b[1]]
}

#[inline(always)]
fn subtract(a: Complex, b: Complex) -> Complex {
    [a[0] - b[0], a[1] - b[1]]
}

/// a − i·b
#[inline(always)]
fn subtract_i(a: Complex, b: Complex) -> Complex {
    [a[0] + b[1], a[1] - b[0]]
}

/// a + i·b
#[inline(always)]
fn add_i(a: Complex, b: Complex) -> Complex {
    [a[0] - b[1], a[1] + b[0]]
}

/// Transform of four values in bit-reversed order x0, x2, x1, x3.
#[inline(always)]
fn butterfly4(x0: Complex, x2: Complex, x1: Complex, x3: Complex) -> [Complex; 4] {
    let (even_sum, even_difference) = (add(x0, x2), subtract(x0, x2));
    let (odd_sum, odd_difference) = (add(x1, x3), subtract(x1, x3));
    [
        add(even_sum, odd_sum),
        subtract_i(even_difference, odd_difference),
        subtract(even_sum, odd_sum),
        add_i(even_difference, odd_difference),
    ]
}

/// √½ in Q31.
const SQRT_HALF: i32 = 0x5A82_799A;

/// √½·v for |v| < 2³⁰.
#[inline(always)]
fn sqrt_half(v: i32) -> i32 {
    multiply(v << 1, SQRT_HALF)
}

/// First pass, radix 8, on eight values in bit-reversed order.
#[inline(always)]
fn butterfly8(x: &mut [Complex; 8]) {
    let even = butterfly4(x[0], x[1], x[2], x[3]);
    let odd = butterfly4(x[4], x[5], x[6], x[7]);
    let eighth = [sqrt_half(odd[1][0] + odd[1][1]), sqrt_half(odd[1][1] - odd[1][0])];
    let three_eighths = [
        sqrt_half(odd[3][1] - odd[3][0]),
        -sqrt_half(odd[3][0] + odd[3][1]),
    ];
    x[0] = add(even[0], odd[0]);
    x[4] = subtract(even[0], odd[0]);
    x[1] = add(even[1], eighth);
    x[5] = subtract(even[1], eighth);
    x[2] = subtract_i(even[2], odd[2]);
    x[6] = add_i(even[2], odd[2]);
    x[3] = add(even[3], three_eighths);
    x[7] = subtract(even[3], three_eighths);
}

/// Radix-4 pass over blocks of 4·Q values, each four transforms of length Q; halves its results.
#[inline(always)]
fn radix4_pass<const Q: usize>(data: &mut [Complex], factors: &[[Complex; 3]; Q]) {
    for block in data.chunks_exact_mut(4 * Q) {
        let Some((x0, rest)) = block.split_first_chunk_mut::<Q>() else {
            return;
        };
        let Some((x2, rest)) = rest.split_first_chunk_mut::<Q>() else {
            return;
        };
        let Some((x1, rest)) = rest.split_first_chunk_mut::<Q>() else {
            return;
        };
        let Some(x3) = rest.first_chunk_mut::<Q>() else {
            return;
        };
        for j in 0..Q {
            let [w1, w2, w3] = factors[j];
            let whole = [x0[j][0] >> 1, x0[j][1] >> 1];
            [x0[j], x2[j], x1[j], x3[j]] =
                butterfly4(whole, turn(x2[j], w2), turn(x1[j], w1), turn(x3[j], w3));
        }
    }
}

/// Splits the transform of the packed complex values into the lower half of the spectrum of the real ones.
#[inline(always)]
fn split(data: &mut [Complex], factors: &[Complex]) {
    let middle = data.len() / 2;
    let (front, back) = data.split_at_mut(middle);
    let ([first, front @ ..], [centre, back @ ..]) = (front, back) else {
        return;
    };
    *first = [
        first[0].saturating_add(first[1]),
        first[0].saturating_sub(first[1]),
    ];
    centre[1] = -centre[1];
    for ((low, high), &w) in front.iter_mut().zip(back.iter_mut().rev()).zip(factors) {
        let even = [(low[0] + high[0]) >> 1, (low[1] - high[1]) >> 1];
        let odd = turn([low[1] + high[1], high[0] - low[0]], w);
        *low = add(even, odd);
        *high = [even[0] - odd[0], odd[1] - even[1]];
    }
}

/// Exchanges the values whose indices are each other's bit reversal, and passes every value through `scale`.
#[inline(always)]
fn sort_bit_reversed<const M: usize>(data: &mut [Complex; M], scale: impl Fn(i32) -> i32) {
    let unused_bits = usize::BITS - M.trailing_zeros();
    for i in 0..M {
        let j = i.reverse_bits() >> unused_bits;
        if i <= j {
            let (a, b) = (data[i], data[j % M]);
            data[i] = [scale(b[0]), scale(b[1])];
            data[j % M] = [scale(a[0]), scale(a[1])];
        }
    }
}

/// Sorts and shifts the block so that it fills `bits` bits and its sign; returns by how many bits it went left.
#[inline(always)]
fn sort_and_normalize<const M: usize>(data: &mut [Complex; M], bits: i32) -> i32 {
    let mut union = 0;
    for z in data.iter() {
        union |= (z[0] ^ (z[0] >> 31)) | (z[1] ^ (z[1] >> 31));
    }
    let left = bits - (i32::BITS - union.leading_zeros()) as i32;
    if left >= 0 {
        sort_bit_reversed(data, |v| v << left);
    } else {
        // Rounded, and one less than M at most: M itself would be one too many.
        let (half, top) = (1 << (-left - 1), (1 << bits) - 1);
        sort_bit_reversed(data, |v| (v.saturating_add(half) >> -left).min(top));
    }
    left
}

/// The spectrum of a block of N real values, a view into their memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transform<'a> {
    /// X\[k\] for k = 1 … N/2 − 1 in units of 2^[`exponent`](Self::exponent); the first entry holds the two real values X\[0\] and X\[N/2\].
    pub bins: &'a [Complex],
    /// Block exponent: X\[k\] = `bins[k]`·2^exponent.
    pub exponent: i32,
}

/// cos and sin of 2π·`numerator`/`denominator` in Q31, rounded to nearest; +1 becomes the largest number there is.
const fn cos_sin(numerator: u32, denominator: u32) -> Complex {
    // Within an eighth of a turn of one of the axes the series converge fast.
    let quadrant = (8 * numerator + denominator) / (2 * denominator);
    let offset = (4 * numerator) as f64 - (quadrant * denominator) as f64;
    let angle = offset / denominator as f64 * core::f64::consts::FRAC_PI_2;
    let (mut cos, mut sin) = (0.0, 0.0);
    let (mut term, mut n) = (1.0, 0);
    while n < 20 {
        match n % 4 {
            0 => cos += term,
            1 => sin += term,
            2 => cos -= term,
            _ => sin -= term,
        }
        n += 1;
        term = term * angle / n as f64;
    }
    match quadrant % 4 {
        0 => [q31(cos), q31(sin)],
        1 => [q31(-sin), q31(cos)],
        2 => [q31(-cos), q31(-sin)],
        _ => [q31(sin), q31(-cos)],
    }
}

/// Q31 of a number from −1 to 1; the cast saturates.
const fn q31(value: f64) -> i32 {
    let scaled = value * 2_147_483_648.0;
    (if scaled < 0.0 { scaled - 0.5 } else { scaled + 0.5 }) as i32
}

/// exp(−2πi·j·r/4Q) for r = 1, 2, 3.
const fn pass_factors<const Q: usize>() -> [[Complex; 3]; Q] {
    let mut table = [[[0; 2]; 3]; Q];
    let mut j = 0;
    while j < Q {
        let span = 4 * Q as u32;
        table[j] = [
            cos_sin(j as u32, span),
            cos_sin(2 * j as u32, span),
            cos_sin(3 * j as u32, span),
        ];
        j += 1;
    }
    table
}

/// exp(−2πi·k/N) for k = 1 … N/4 − 1 = COUNT.
const fn split_factors<const COUNT: usize>() -> [Complex; COUNT] {
    let mut table = [[0; 2]; COUNT];
    let mut k = 0;
    while k < COUNT {
        table[k] = cos_sin(k as u32 + 1, 4 * (COUNT as u32 + 1));
        k += 1;
    }
    table
}

static PASS_4: [[Complex; 3]; 4] = pass_factors();
static PASS_8: [[Complex; 3]; 8] = pass_factors();
static PASS_16: [[Complex; 3]; 16] = pass_factors();
static PASS_32: [[Complex; 3]; 32] = pass_factors();
static PASS_64: [[Complex; 3]; 64] = pass_factors();
static PASS_128: [[Complex; 3]; 128] = pass_factors();
static PASS_256: [[Complex; 3]; 256] = pass_factors();
static PASS_512: [[Complex; 3]; 512] = pass_factors();

/// First pass of transforms whose half length is a power of four.
fn first_pass_4(data: &mut [Complex]) {
    for x in data.as_chunks_mut::<4>().0 {
        *x = butterfly4(x[0], x[1], x[2], x[3]);
    }
}

/// First pass of all others.
fn first_pass_8(data: &mut [Complex]) {
    data.as_chunks_mut::<8>().0.iter_mut().for_each(butterfly8);
}

macro_rules! real_transform {
    ($name:ident, $points:literal, $first:ident, $($factors:ident),+) => {
        #[doc = concat!("Transform of ", stringify!($points), " real values in place.")]
        pub fn $name(data: &mut [i32; $points]) -> Transform<'_> {
            const PASSES: i32 = [$($factors.len()),+].len() as i32;
            const BITS: i32 = 31 + PASSES - ($points as u32).trailing_zeros() as i32;
            static SPLIT: [Complex; $points / 4 - 1] = split_factors();

            let (complex, _) = data.as_chunks_mut::<2>();
            let Some(values) = complex.first_chunk_mut::<{ $points / 2 }>() else {
                return Transform { bins: &[], exponent: 0 };
            };
            let left = sort_and_normalize(values, BITS);
            $first(values);
            $(radix4_pass(values, &$factors);)+
            split(values, &SPLIT);
            Transform { bins: values, exponent: PASSES - left }
        }
    };
}

real_transform!(rfft_256, 256, first_pass_8, PASS_8, PASS_32);
real_transform!(rfft_512, 512, first_pass_4, PASS_4, PASS_16, PASS_64);
real_transform!(rfft_1024, 1024, first_pass_8, PASS_8, PASS_32, PASS_128);
real_transform!(rfft_2048, 2048, first_pass_4, PASS_4, PASS_16, PASS_64, PASS_256);
real_transform!(rfft_4096, 4096, first_pass_8, PASS_8, PASS_32, PASS_128, PASS_512);
