//! Elementary functions: the only place that may approximate.
//!
//! Every function is built from IEEE additions, multiplications and divisions in a fixed order, so that it returns the same
//! bits on every target; only the sign and payload of a NaN are the processor's own. Each states its largest error; a test holds it over the whole domain.
//! One ulp is the distance from the true value to its neighbour in `f32`.
//!
//! The functions of `libm` used here work in single precision: on a Cortex-M4F double precision is software.

use core::f32::consts::TAU;

use micromath::F32;

/// Largest integer not above `x`. Exact.
pub fn floor(x: f32) -> f32 {
    libm::floorf(x)
}

/// Nearest integer, halves away from zero. Exact.
pub fn round(x: f32) -> f32 {
    libm::roundf(x)
}

/// Square root, within 1 ulp; NaN below zero.
///
/// Newton's iteration on the start value of micromath's inverse square root takes half the instructions of a root
/// in integers; those at the ends of the range, where the iteration would leave it, are libm's.
pub fn sqrt(x: f32) -> f32 {
    // As bits, so that one comparison also keeps out zero, negative numbers and NaN.
    let smallest = f32::MIN_POSITIVE.to_bits();
    let largest = exp2i(126).to_bits();
    if x.to_bits().wrapping_sub(smallest) >= largest - smallest {
        return libm::sqrtf(x);
    }
    let half = 0.5 * x;
    let mut inverse = F32(x).invsqrt().0;
    // The start is off by at most e = 0.036; each step makes it 1.5·e²: 2e-3, 6e-6.
    for _ in 0..2 {
        inverse *= 1.5 - half * inverse * inverse;
    }
    // One more step on the root itself leaves its rounding only.
    let root = x * inverse;
    root + 0.5 * inverse * (x - root * root)
}

/// √(x² + y²) without overflow on the way, within 3 ulp.
pub fn hypot(x: f32, y: f32) -> f32 {
    let (x, y) = (x.abs(), y.abs());
    let (large, small) = if x > y { (x, y) } else { (y, x) };
    if large == 0.0 || large == f32::INFINITY {
        return large;
    }
    let ratio = small / large;
    large * sqrt(1.0 + ratio * ratio)
}

/// Sine and cosine of an angle in turns, within 1.2e-7 for every finite angle.
///
/// An angle in turns is reduced without any error, so the bound holds however large it is.
pub fn sin_cos_turns(turns: f32) -> (f32, f32) {
    let fraction = turns - round(turns);
    let quadrant = round(4.0 * fraction);
    let x = fraction - 0.25 * quadrant;
    // Taylor series in turns: |x| ≤ 1/8, the first terms left out are below 2e-9.
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
        // Two quadrants either way; a NaN ends here too, and stays one.
        _ => (-sin, -cos),
    }
}

/// Sine of an angle in turns, within 1.2e-7.
pub fn sin_turns(turns: f32) -> f32 {
    sin_cos_turns(turns).0
}

/// Cosine of an angle in turns, within 1.2e-7.
pub fn cos_turns(turns: f32) -> f32 {
    sin_cos_turns(turns).1
}

/// Angle of the point (x, y) in radians, from −π to π, within 2 ulp.
pub fn atan2(y: f32, x: f32) -> f32 {
    libm::atan2f(y, x)
}

/// Angle of the point (x, y) in turns, from −½ to ½, within 3 ulp.
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

/// A ratio of powers in decibel, within 1e-4 dB; what is below the smallest normal number, and NaN, count as that.
pub fn decibel(power_ratio: f32) -> f32 {
    10.0 * log10(power_ratio.max(f32::MIN_POSITIVE))
}

/// 2 to an integer power, exact from −126 to 127 and held to that range.
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
