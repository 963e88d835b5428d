//! Runs the signal chain on fixed inputs and computes one digest of the results of each stage.
//!
//! The instruction-counting firmware image and the tests both contain this file. Their digests must agree, since the chain computes
//! the same bits on every target.

use quietcut_core::acceleration::Counts;
use quietcut_core::decimation::{self, Decimation, Sample};
use quietcut_core::math;
use quietcut_core::peaks::{Rotation, Search};
use quietcut_core::spectrum::{
    self, Overlap, PowerSpectrum, STRUCTURE_BINS, STRUCTURE_POINTS, TOOL_BINS, TOOL_POINTS,
};
use quietcut_core::units::Hertz;

/// FNV-1a over 32-bit words.
struct Digest(u32);

impl Digest {
    fn new() -> Self {
        Self(2_166_136_261)
    }

    fn word(&mut self, word: u32) {
        self.0 = (self.0 ^ word).wrapping_mul(16_777_619);
    }

    fn float(&mut self, value: f32) {
        // Sign and payload of a NaN depend on the processor.
        self.word(if value.is_nan() { u32::MAX } else { value.to_bits() });
    }

    fn sample(&mut self, sample: Option<Sample>) {
        match sample {
            Some(sample) => sample.into_iter().for_each(|value| self.word(value as u32)),
            None => self.word(0x5555_5555),
        }
    }
}

/// Linear congruential generator with the same numbers on every target.
struct Noise(u32);

impl Noise {
    fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        // The lower bits of a linear congruential generator have short periods.
        self.0 ^ (self.0 >> 16)
    }
}

/// Digest of all functions of `math` over small, large, negative and special numbers.
pub fn of_math() -> u32 {
    let (mut digest, mut noise) = (Digest::new(), Noise(1));
    for _ in 0..5000 {
        let (x, y) = (f32::from_bits(noise.next()), f32::from_bits(noise.next()));
        let (sin, cos) = math::sin_cos_turns(x);
        let (near_sin, near_cos) = math::sin_cos_turns(x % 1.0);
        let values = [
            math::floor(x),
            math::round(x),
            math::sqrt(x),
            math::hypot(x, y),
            math::atan2(y, x),
            math::atan2_turns(y, x),
            math::ln(x),
            math::log10(x),
            math::exp(x),
            math::exp(x % 80.0),
            math::decibel(x),
            math::exp2i(noise.next() as i32 % 130),
        ];
        for value in [sin, cos, near_sin, near_cos].into_iter().chain(values) {
            digest.float(value);
        }
    }
    digest.0
}

/// 4000 sensor samples of an artificial cut: noise, gravity and two sines.
pub fn counts() -> impl Iterator<Item = Counts> {
    let mut noise = Noise(2);
    (0..4000).map(move |n| {
        let turns = n as f32 * 0.023_7;
        let tone = 3000.0 * math::sin_turns(turns) + 900.0 * math::sin_turns(0.41 * turns);
        [0, 1, 2].map(|axis| (tone as i16 >> axis) + (noise.next() as i16 >> 6) + 2048)
    })
}

/// Digest of both bands of the decimation cascade at sampling rates that use every kind of stage.
pub fn of_decimation() -> u32 {
    let mut digest = Digest::new();
    for rate in [1_000.0, 10_000.0, 25_600.0, 26_667.0] {
        let Ok(decimation) = Decimation::new(Hertz(rate)) else {
            return 0;
        };
        let mut state = decimation::State::new();
        for counts in counts() {
            let output = decimation.step(&mut state, counts);
            digest.sample(output.tool);
            digest.sample(output.structure);
        }
    }
    digest.0
}

/// Buffers of the spectra, too large for a stack.
pub struct Memory {
    /// The tool band's block.
    pub tool: Overlap<TOOL_POINTS>,
    /// Scratch memory of its spectrum.
    pub tool_work: [i32; TOOL_POINTS],
    /// Its spectrum.
    pub tool_power: [f32; TOOL_BINS],
    /// The structure band's block.
    pub structure: Overlap<STRUCTURE_POINTS>,
    /// Scratch memory of its spectrum.
    pub structure_work: [f32; STRUCTURE_POINTS],
    /// Its spectrum.
    pub structure_power: [f32; STRUCTURE_BINS],
}

impl Memory {
    /// Creates empty buffers.
    #[allow(clippy::new_without_default)] // `const` is what it is for
    pub const fn new() -> Self {
        Self {
            tool: Overlap::new(),
            tool_work: [0; TOOL_POINTS],
            tool_power: [0.0; TOOL_BINS],
            structure: Overlap::new(),
            structure_work: [0.0; STRUCTURE_POINTS],
            structure_power: [0.0; STRUCTURE_BINS],
        }
    }

    /// Fills both blocks with samples of the artificial cut.
    pub fn fill(&mut self) {
        for counts in counts() {
            let sample = counts.map(|count| i32::from(count) << decimation::FRACTION_BITS);
            self.tool.push(sample, TOOL_POINTS);
            self.structure.push(sample, STRUCTURE_POINTS);
        }
    }

    /// Power spectrum of the tool band, summed over all axes.
    pub fn tool_spectrum(&mut self) -> PowerSpectrum<'_> {
        let rate = Hertz(13_333.0);
        spectrum::tool_spectrum(
            &self.tool,
            &[0, 1, 2],
            rate,
            1e-6,
            &mut self.tool_work,
            &mut self.tool_power,
        )
    }

    /// Power spectrum of the structure band, summed over all axes.
    pub fn structure_spectrum(&mut self) -> PowerSpectrum<'_> {
        let (work, power) = (&mut self.structure_work, &mut self.structure_power);
        spectrum::structure_spectrum(&self.structure, &[0, 1, 2], Hertz(1_666.7), 1e-6, work, power)
    }
}

/// Searches for a spectral line that is no spindle harmonic.
pub fn search(spectrum: PowerSpectrum<'_>) -> Search {
    let last = spectrum.power.len() as f32 * spectrum.bin.0;
    let rotation = Rotation {
        frequency: Hertz(0.05 * last),
        uncertainty: Hertz(1e-5 * last),
    };
    spectrum.dominant_non_harmonic(rotation, Hertz(0.0), Hertz(last))
}

/// Digest of both spectra and of the lines found in them.
pub fn of_spectra(memory: &mut Memory) -> u32 {
    fn note(digest: &mut Digest, spectrum: PowerSpectrum<'_>) {
        spectrum.power.iter().for_each(|&power| digest.float(power));
        match search(spectrum) {
            Search::Found(found) => {
                digest.word(found.nearest_order);
                let peak = found.peak;
                [peak.frequency.0, peak.amplitude.0, peak.snr, found.orders_off]
                    .into_iter()
                    .for_each(|value| digest.float(value));
            }
            Search::Nothing { resolved_to } => digest.float(resolved_to.0),
            Search::Unresolved => digest.word(0),
        }
    }
    let mut digest = Digest::new();
    memory.fill();
    note(&mut digest, memory.tool_spectrum());
    note(&mut digest, memory.structure_spectrum());
    digest.0
}
