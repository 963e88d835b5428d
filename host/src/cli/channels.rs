//! Channels and noise of the recording that `quietcut simulate` writes.

use clap::ValueEnum;

use super::{Error, non_negative};
use crate::recording::{Quantity, Recording};
use crate::simulate::rig::Noise;

/// Options for the channels of a simulated recording and for their noise.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Channels")]
pub(super) struct Channels {
    /// Motion quantities (displacement, velocity, acceleration) to record besides the force, in every direction of the
    /// structure.
    #[arg(
        long,
        value_name = "WHAT,…",
        value_delimiter = ',',
        default_value = "displacement,acceleration"
    )]
    measure: Vec<Measured>,
    /// White noise added to every channel: standard deviation in percent of the root mean square of the channel. The
    /// accelerometer of a cut has its own noise (--noise-ug) unless --ideal is given.
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = non_negative, allow_negative_numbers = true)]
    noise_percent: f64,
    /// Standard deviation of the noise of one channel in its SI unit, such as fx=0.02. Replaces --noise-percent for
    /// this channel; may be repeated.
    #[arg(long, value_name = "CHANNEL=VALUE", value_parser = channel_noise)]
    noise: Vec<(String, f64)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Measured {
    Displacement,
    Velocity,
    Acceleration,
    /// No motion: only the force.
    None,
}

impl Channels {
    /// Motion quantities that a simulated recording contains besides the force, from the option `--measure`.
    pub(super) fn measured(&self) -> Vec<Quantity> {
        self.measure
            .iter()
            .filter_map(|measured| match measured {
                Measured::Displacement => Some(Quantity::Displacement),
                Measured::Velocity => Some(Quantity::Velocity),
                Measured::Acceleration => Some(Quantity::Acceleration),
                Measured::None => None,
            })
            .collect()
    }

    /// Adds the configured measurement noise to the channels of the simulated `recording`; `seed` sets the random
    /// numbers.
    ///
    /// # Errors
    /// `--noise` names a channel that the recording does not have.
    pub(super) fn add_noise(&self, recording: &mut Recording, seed: u64) -> Result<(), Error> {
        let noise = Noise {
            relative: 0.01 * self.noise_percent,
            absolute: self.noise.iter().cloned().collect(),
        };
        if let Some(name) = noise
            .absolute
            .keys()
            .find(|name| recording.channel(name).is_none())
        {
            return Err(Error::input(recording.lacks(name.clone())));
        }
        noise.add(recording, seed);
        Ok(())
    }
}

fn channel_noise(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text
        .split_once('=')
        .ok_or_else(|| format!("`{text}` is not of the form CHANNEL=VALUE, such as fx=0.02"))?;
    Ok((name.trim().into(), non_negative(value.trim())?))
}
