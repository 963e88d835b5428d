//! Elementary functions: the only functions of this crate that may approximate.
//!
//! Every function consists of IEEE additions, multiplications and divisions in a fixed order, so that it returns the
//! same bits on every target. Only the sign and payload of a NaN depend on the processor. Each function states its
//! largest error, which a test checks over the whole domain. One ulp is the distance from the true value to the next
//! `f32` number.
//!
//! The functions of `libm` used here compute in single precision, because a Cortex-M4F emulates double precision in
//! software.

use core::f32::consts::TAU;

use micromath::F32;

/// Largest integer not above `x`, without rounding error.
pub fn floor(x: f32) -> f32 {
    libm::floorf(x)
}

/// Integer nearest to `x`, without rounding error; halves are rounded away from zero.
pub fn round(x: f32) -> f32 {
    libm::roundf(x)
}

/// Square root, within 1 ulp; NaN for negative numbers.
///
/// Newton's iteration from the initial value of micromath's inverse square root takes half the instructions of an
/// integer square root. Numbers near the ends of the `f32` range, where the iteration would overflow, use libm.
pub fn sqrt(x: f32) -> f32 {
    // The comparison of bit patterns excludes numbers outside the range, and also zero, negative numbers and NaN.
    let smallest = f32::MIN_POSITIVE.to_bits();
    let largest = exp2i(126).to_bits();
    if x.to_bits().wrapping_sub(smallest) >= largest - smallest {
        return libm::sqrtf(x);
    }
    let half = 0.5 * x;
    let mut inverse = F32(x).invsqrt().0;
    // The relative error of the initial value of 1/√x is at most e = 0.036. Each Newton step reduces it to 1.5·e²:
    // 2e-3, then 6e-6.
    for _ in 0..2 {
        inverse *= 1.5 - half * inverse * inverse;
    }
    // One more Newton step on √x itself reduces its error to rounding.
    let root = x * inverse;
    root + 0.5 * inverse * (x - root * root)
}

/// √(x² + y²) within 3 ulp, without overflow of the squares.
pub fn hypot(x: f32, y: f32) -> f32 {
    let (x, y) = (x.abs(), y.abs());
    let (large, small) = if x > y { (x, y) } else { (y, x) };
    if large == 0.0 || large == f32::INFINITY {
        return large;
    }
    let ratio = small / large;
    large * sqrt(1.0 + ratio * ratio)
}

/// Sine and cosine of an angle in revolutions, within 1.2e-7 for every finite angle.
///
/// The reduction of an angle in revolutions to one revolution is exact, so that the bound does not depend on the size
/// of the angle.
pub fn sin_cos_turns(turns: f32) -> (f32, f32) {
    let fraction = turns - round(turns);
    let quadrant = round(4.0 * fraction);
    let x = fraction - 0.25 * quadrant;
    // Taylor series of sin and cos for |x| ≤ 1/8 revolution. The first omitted terms are below 2e-9.
    let square = x * x;
    let sin =
        x * (TAU + square * (-41.341_7 + square * (81.605_25 + square * (-76.705_86 + square * 42.058_69))));
    let cos = 1.0
        + square
            * (-19.739_209
                + square * (64.939_39 + square * (-85.456_82 + square * (60.244_64 + square * -26.426_256))));
    match quadrant as i32 {
        0 => (sin, cos),
        1 => (cos, -sin),
        -1 => (-cos, sin),
        // The remaining quadrants, −2 and 2, are half a revolution. A NaN becomes quadrant 0, where both results are
        // NaN.
        _ => (-sin, -cos),
    }
}

/// Sine of an angle in revolutions, within 1.2e-7.
pub fn sin_turns(turns: f32) -> f32 {
    sin_cos_turns(turns).0
}

/// Cosine of an angle in revolutions, within 1.2e-7.
pub fn cos_turns(turns: f32) -> f32 {
    sin_cos_turns(turns).1
}

/// Angle of the point (x, y) in radians, from −π to π, within 2 ulp.
pub fn atan2(y: f32, x: f32) -> f32 {
    libm::atan2f(y, x)
}

/// Angle of the point (x, y) in revolutions, from −½ to ½, within 3 ulp.
pub fn atan2_turns(y: f32, x: f32) -> f32 {
    atan2(y, x) / TAU
}

/// Natural logarithm, within 1 ulp.
pub fn ln(x: f32) -> f32 {
    libm::logf(x)
}

/// Logarithm to base 10, within 2 ulp.
pub fn log10(x: f32) -> f32 {
    libm::log10f(x)
}

/// e to the power `x`, within 1 ulp.
pub fn exp(x: f32) -> f32 {
    libm::expf(x)
}

/// A ratio of powers in decibel, within 1e-4 dB. Ratios below the smallest normal `f32` number, and NaN, count as
/// that number.
pub fn decibel(power_ratio: f32) -> f32 {
    10.0 * log10(power_ratio.max(f32::MIN_POSITIVE))
}

/// 2 to the power of `exponent`, which is clamped to −126 … 127; without rounding error.
pub const fn exp2i(exponent: i32) -> f32 {
    let held = if exponent < -126 {
        -126
    } else if exponent > 127 {
        127
    } else {
        exponent
    };
    f32::from_bits(((held + 127) as u32) << 23)
}
