//! Fixed-point Fourier transform of real samples: 32-bit data, Q31 twiddle factors, one block exponent.
//!
//! Forward transform, X\[k\] = Σ x\[n\]·exp(−2πi·k·n/N), of N = 256 … 4096 real values, in place.
//!
//! The N real values are packed into N/2 complex ones. The steps are, in order:
//! 1. a radix-4 pass without multiplications, over values whose distance is a quarter of the block;
//! 2. a sort into bit-reversed order;
//! 3. a radix-2 pass, if N/2 is no power of four;
//! 4. radix-4 passes with twiddle factors;
//! 5. the split into the spectrum of the real values.
//!
//! **Scaling.** The input is shifted once, as a block, so that its largest value just leaves the headroom that the
//! transform needs. No later pass depends on the data. A product with a Q31 factor keeps its high word, which halves
//! it. The input of a radix-4 butterfly that has no factor is halved too. So each radix-4 pass with factors doubles
//! the amplitude of a tone and keeps the amplitude of white noise, and for every N the largest result is just below
//! 2³¹.
//!
//! **No overflow.** Let p be the number of radix-4 passes with factors and M = 2^(31+p)/N. The shifted input lies in
//! −M … M − 1.
//! 1. Every intermediate value of Z, the transform of the packed values, is a sum of some packed values of modulus ≤
//!    √2·M, times factors of modulus 1, halved in each pass with factors. The sum of all N/2 gives |Z| ≤
//!    √2·(N/2)·M/2^p = √½·2³¹. Before the last pass the bound is half of that, and the sums inside a butterfly have
//!    fewer terms than its results.
//! 2. The split forms Z\[k\] ± Z*\[N/2 − k\], twice the transform of the even or the odd samples. Its real or
//!    imaginary part is at most 2·(N/2)·M/2^p·c = 2³¹·c, where c is the mean of |cos| over the phases of the samples:
//!    1 for k = 0, which has its own formula, and at most √½ for all other k < N/4 (four phases per period).
//! 3. X\[k\] itself is bounded by 2³¹·√½ for the same reason. Only X\[0\] and X\[N/2\] can reach 2³¹, for a block of
//!    −M. These two sums saturate.
//!
//! Rounding adds less than 2^(p+3) units to any of these values, far less than the margins in 1 to 3.
//!
//! **Cost and accuracy**, 1024 points, on an emulated Cortex-M4F, 16-bit tone between two bins at −1 and −40 dBFS
//! against an exact transform:
//!
//! | | instructions | SNR |
//! |---|---|---|
//! | this one, rustc 1.95, target-cpu=cortex-m4 | 45 225 | 146 / 143 dB |
//! | microfft `rfft_1024` (f32), the same | 50 059 | float |
//! | microfft `rfft_1024` (f32), rustc 1.95, no target-cpu | 47 538 | float |
//! | CMSIS-DSP `arm_rfft_fast_f32`, gcc 12.2 -O3, loops unrolled | 44 676 | float |
//! | CMSIS-DSP `arm_rfft_q15`, the same | 44 234 | 47 / 10 dB |
//! | CMSIS-DSP `arm_rfft_q31`, the same | 87 025 | 139 / 100 dB |
//!
//! The test `signal_chain_on_target` counts the instructions of the first two rows and compares them with these
//! figures. Without `target-cpu=cortex-m4` this transform takes 58 515 instructions.

/// Complex number with integer parts: real, imaginary.
pub type Complex = [i32; 2];

/// Rounded high word of a product: a·b/2³². If b is a Q31 number, the result is half the product.
#[inline(always)]
fn multiply(a: i32, b: i32) -> i32 {
    ((a as i64 * b as i64 + 0x8000_0000) >> 32) as i32
}

/// `sum` + a·b/2³², rounded.
#[inline(always)]
fn multiply_add(sum: i32, a: i32, b: i32) -> i32 {
    ((((sum as i64) << 32) + a as i64 * b as i64 + 0x8000_0000) >> 32) as i32
}

/// Half the product of z and exp(−iφ), for `factor` = \[cos φ, sin φ\] in Q31.
#[inline(always)]
fn turn(z: Complex, factor: Complex) -> Complex {
    let [cos, sin] = factor;
    [
        multiply_add(multiply(z[0], cos), z[1], sin),
        multiply(z[1], cos) - multiply(z[0], sin),
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

/// First pass of the Fourier transform: applies `scale` to every value, then transforms each four values whose distance
/// is a quarter of the block. The results are in bit-reversed order.
#[inline(always)]
fn first_pass(data: &mut [Complex], scale: impl Fn(i32) -> i32) {
    let (lower, upper) = data.split_at_mut(data.len() / 2);
    let (x0, x1) = lower.split_at_mut(lower.len() / 2);
    let (x2, x3) = upper.split_at_mut(upper.len() / 2);
    for (((x0, x1), x2), x3) in x0.iter_mut().zip(x1).zip(x2).zip(x3) {
        let [a, b, c, d] = [*x0, *x1, *x2, *x3].map(|z| z.map(&scale));
        let (even_sum, even_difference) = (add(a, c), subtract(a, c));
        let (odd_sum, odd_difference) = (add(b, d), subtract(b, d));
        *x0 = add(even_sum, odd_sum);
        *x1 = subtract(even_sum, odd_sum);
        *x2 = subtract_i(even_difference, odd_difference);
        *x3 = add_i(even_difference, odd_difference);
    }
}

/// Radix-2 pass of the Fourier transform: joins two transforms of length 4 into one of length 8, in each block of eight
/// values.
#[inline(always)]
fn radix2_pass(data: &mut [Complex]) {
    const SQRT_HALF: i32 = 0x5A82_799A;
    // `black_box` keeps the compiler from replacing the product with a constant by slower shifts and sums.
    let root = core::hint::black_box(SQRT_HALF);
    let sqrt_half = |v: i32| multiply(v << 1, root);
    for x in data.as_chunks_mut::<8>().0 {
        (x[0], x[4]) = (add(x[0], x[4]), subtract(x[0], x[4]));
        let turned = [sqrt_half(x[5][0] + x[5][1]), sqrt_half(x[5][1] - x[5][0])];
        (x[1], x[5]) = (add(x[1], turned), subtract(x[1], turned));
        (x[2], x[6]) = (subtract_i(x[2], x[6]), add_i(x[2], x[6]));
        let turned = [sqrt_half(x[7][0] + x[7][1]), sqrt_half(x[7][1] - x[7][0])];
        (x[3], x[7]) = (subtract_i(x[3], turned), add_i(x[3], turned));
    }
}

/// Radix-4 pass of the Fourier transform: joins four transforms of length Q into one of length 4·Q, in each block of
/// 4·Q values. The results are halved.
#[inline(always)]
fn radix4_pass<const Q: usize>(data: &mut [Complex], factors: &[[Complex; 3]; Q]) {
    for block in data.chunks_exact_mut(4 * Q) {
        // The four transforms of length Q in a block are stored in bit-reversed order: 0, 2, 1, 3.
        let Some([x0, x2, x1, x3]) = quarters::<Q>(block) else {
            return;
        };
        for j in 0..Q {
            let w = &factors[j];
            let t1 = turn(x1[j], w[0]);
            let t3 = turn(x3[j], w[2]);
            let (odd_sum, odd_difference) = (add(t1, t3), subtract(t1, t3));
            let t2 = turn(x2[j], w[1]);
            let t0 = [x0[j][0] >> 1, x0[j][1] >> 1];
            let (even_sum, even_difference) = (add(t0, t2), subtract(t0, t2));
            x0[j] = add(even_sum, odd_sum);
            x2[j] = subtract_i(even_difference, odd_difference);
            x1[j] = subtract(even_sum, odd_sum);
            x3[j] = add_i(even_difference, odd_difference);
        }
    }
}

/// Splits a block of 4·Q values of the transform into its four quarters; `None` if the block has fewer values.
#[inline(always)]
fn quarters<const Q: usize>(block: &mut [Complex]) -> Option<[&mut [Complex; Q]; 4]> {
    let (first, rest) = block.split_first_chunk_mut()?;
    let (second, rest) = rest.split_first_chunk_mut()?;
    let (third, rest) = rest.split_first_chunk_mut()?;
    Some([first, second, third, rest.first_chunk_mut()?])
}

/// Computes the spectrum of N real values from the Fourier transform of the N/2 packed complex values, in place.
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

/// Sorts the values of the transform into bit-reversed order: exchanges each value with the one at the bit-reversed
/// index.
#[inline(always)]
fn sort_bit_reversed<const M: usize>(data: &mut [Complex; M]) {
    // For the exchange, the bits of an index are a high half, one middle bit if their number is odd, and a low half.
    let half = M.trailing_zeros() / 2;
    let odd = M.trailing_zeros() % 2;
    let reversed = |bits: usize| bits.reverse_bits() >> (usize::BITS - half);
    for a in 0..1 << half {
        for b in a + 1..1 << half {
            for middle in 0..1 << odd {
                let i = a << (half + odd) | middle << half | reversed(b);
                let j = b << (half + odd) | middle << half | reversed(a);
                data.swap(i % M, j % M);
            }
        }
    }
}

/// Number of bits, without the sign bit, of the largest real or imaginary part in the block.
#[inline(always)]
fn bits_used(data: &[Complex]) -> i32 {
    let magnitude = |v: i32| v ^ (v >> 31);
    let union = data
        .iter()
        .fold(0, |union, z| union | magnitude(z[0]) | magnitude(z[1]));
    (i32::BITS - union.leading_zeros()) as i32
}

/// First pass of the Fourier transform on a block, shifted so that its largest magnitude has `bits` bits without the
/// sign bit. Returns the left shift in bits.
#[inline(always)]
fn normalized_first_pass(data: &mut [Complex], bits: i32) -> i32 {
    let left = bits - bits_used(data);
    if left >= 0 {
        first_pass(data, |v| v << left);
    } else {
        // Rounding up may need one more bit than `bits`, so each shifted value is limited to `largest`.
        let (half, largest) = (1 << (-left - 1), (1 << bits) - 1);
        first_pass(data, |v| (v.saturating_add(half) >> -left).min(largest));
    }
    left
}

/// The spectrum of a block of N real values, stored in the memory of the block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transform<'a> {
    /// X\[k\] for k = 1 … N/2 − 1 in units of 2^[`exponent`](Self::exponent); the first entry holds the two real
    /// values X\[0\] and X\[N/2\].
    pub bins: &'a [Complex],
    /// Block exponent: X\[k\] = `bins[k]`·2^exponent.
    pub exponent: i32,
}

/// cos and sin of the angle 2π·`numerator`/`denominator` as Q31 numbers, rounded to nearest. +1 becomes 1 − 2⁻³¹, the
/// largest Q31 number.
const fn cos_sin(numerator: u32, denominator: u32) -> Complex {
    // The angle is measured from the nearest axis, at most π/4 away, where the Taylor series of cos and sin converge
    // fast.
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

/// The nearest Q31 number of a value from −1 to 1. The cast saturates.
const fn q31(value: f64) -> i32 {
    let scaled = value * 2_147_483_648.0;
    (if scaled < 0.0 { scaled - 0.5 } else { scaled + 0.5 }) as i32
}

/// Twiddle factors exp(−iφ) of a radix-4 pass, stored as \[cos φ, sin φ\]: φ = 2π·j·r/4Q for j = 0 … Q − 1 and
/// r = 1, 2, 3.
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

/// Twiddle factors exp(−iφ), stored as \[cos φ, sin φ\], with which the transform of packed values is split into that
/// of N real values: φ = 2π·k/N for k = 1 … N/4 − 1 = COUNT.
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

macro_rules! real_transform {
    ($name:ident, $points:literal, $($factors:ident),+) => {
        #[doc = concat!("Transform of ", stringify!($points), " real values in place.")]
        #[inline(never)]
        pub fn $name(data: &mut [i32; $points]) -> Transform<'_> {
            const PASSES: i32 = [$($factors.len()),+].len() as i32;
            const BITS: i32 = 31 + PASSES - ($points as u32).trailing_zeros() as i32;
            static SPLIT: [Complex; $points / 4 - 1] = split_factors();

            let (complex, _) = data.as_chunks_mut::<2>();
            let Some(values) = complex.first_chunk_mut::<{ $points / 2 }>() else {
                return Transform { bins: &[], exponent: 0 };
            };
            let left = normalized_first_pass(values, BITS);
            sort_bit_reversed(values);
            if !values.len().trailing_zeros().is_multiple_of(2) {
                radix2_pass(values);
            }
            $(radix4_pass(values, &$factors);)+
            split(values, &SPLIT);
            Transform { bins: values, exponent: PASSES - left }
        }
    };
}

real_transform!(rfft_256, 256, PASS_8, PASS_32);
real_transform!(rfft_512, 512, PASS_4, PASS_16, PASS_64);
real_transform!(rfft_1024, 1024, PASS_8, PASS_32, PASS_128);
real_transform!(rfft_2048, 2048, PASS_4, PASS_16, PASS_64, PASS_256);
real_transform!(rfft_4096, 4096, PASS_8, PASS_32, PASS_128, PASS_512);

#[cfg(test)]
mod tests {
    use super::*;

    /// Every factor is the rounded cosine and sine, where 1 − 2⁻³¹ replaces 1.
    #[test]
    fn factors_are_rounded_cosines_and_sines() {
        let check = |found: Complex, turns: f64| {
            let (sin, cos) = (core::f64::consts::TAU * turns).sin_cos();
            for (found, exact) in found.into_iter().zip([cos, sin]) {
                let exact = (exact * 2f64.powi(31)).min(f64::from(i32::MAX));
                // Half a Q31 unit of rounding, plus the error of the double-precision reference.
                assert!(
                    (f64::from(found) - exact).abs() <= 0.5 + 1e-6,
                    "{turns} turns: {found} for {exact}"
                );
            }
        };
        for span in [16, 32, 64, 128, 256, 512, 1024, 2048, 4096] {
            for i in 0..3 * span / 4 {
                check(cos_sin(i, span), f64::from(i) / f64::from(span));
            }
        }
        for (j, factors) in PASS_128.iter().enumerate() {
            for (r, &factor) in factors.iter().enumerate() {
                check(factor, ((r + 1) * j) as f64 / 512.0);
            }
        }
        for (k, &factor) in split_factors::<255>().iter().enumerate() {
            check(factor, (k + 1) as f64 / 1024.0);
        }
    }
}
