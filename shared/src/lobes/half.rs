//! IEEE 754 binary16 numbers, converted in integer arithmetic so that host and device agree to the bit.

/// The largest finite binary16 number.
pub(super) const MAX: f32 = 65_504.0;

/// The exact value of a binary16 code. Infinities and NaN are preserved.
pub(super) fn decode(code: u16) -> f32 {
    let sign = u32::from(code & 0x8000) << 16;
    let exponent = u32::from(code >> 10) & 0x1F;
    let fraction = u32::from(code & 0x3FF);
    match exponent {
        // Zero and subnormal binary16 numbers are multiples of 2⁻²⁴, which are exact in single precision.
        0 => {
            let size = fraction as f32 * (1.0 / 16_777_216.0);
            f32::from_bits(size.to_bits() | sign)
        }
        31 => f32::from_bits(sign | 0x7F80_0000 | fraction << 13),
        _ => f32::from_bits(sign | (exponent + 112) << 23 | fraction << 13),
    }
}

/// The nearest binary16 code, ties to even. Magnitudes above [`MAX`] saturate at it; NaN stays NaN.
pub(super) fn encode(value: f32) -> u16 {
    let sign = ((value.to_bits() >> 16) & 0x8000) as u16;
    let size = f32::from_bits(value.to_bits() & 0x7FFF_FFFF);
    if size.is_nan() {
        return 0x7E00;
    }
    if size >= MAX {
        return sign | 0x7BFF;
    }
    // Below 2⁻¹⁴ (subnormal) a binary16 code is a multiple of 2⁻²⁴. Above, it is the upper bits of the f32 with the
    // exponent rebased.
    let (bits, step) = if size < 1.0 / 16_384.0 {
        // In [1/2, 1) the last bit of an f32 has the value 2⁻²⁴, so that adding 1/2 rounds a number to a multiple of
        // 2⁻²⁴.
        return sign | ((size + 0.5).to_bits() - 0.5_f32.to_bits()) as u16;
    } else {
        (size.to_bits() - (112 << 23), 1_u32 << 13)
    };
    let even = (bits >> 13) & 1;
    let rounded = (bits + (step >> 1) - 1 + even) >> 13;
    sign | rounded.min(0x7BFF) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_comes_back() {
        for code in 0..=u16::MAX {
            let value = decode(code);
            if value.is_finite() {
                assert_eq!(encode(value), code, "{code:04x} {value}");
            }
        }
    }

    #[test]
    fn the_nearest_code_is_taken() {
        // Codes of known values from the IEEE 754 standard.
        for (value, code) in [
            (1.0, 0x3C00),
            (-2.0, 0xC000),
            (65_504.0, 0x7BFF),
            (5.960_464_5e-8, 1),
            (0.333_25, 0x3555),
        ] {
            assert_eq!(encode(value), code, "{value}");
        }
        assert_eq!((encode(1e9), encode(f32::NEG_INFINITY)), (0x7BFF, 0xFBFF));
        let mut value = 1e-9_f32;
        while value < 6e4 {
            let back = decode(encode(value));
            // Half a unit in the last of 11 significant bits, or half of the smallest subnormal number.
            assert!(
                (back - value).abs() <= (value / 2048.0).max(0.5 / 16_777_216.0),
                "{value} {back}"
            );
            value *= 1.01;
        }
    }
}
