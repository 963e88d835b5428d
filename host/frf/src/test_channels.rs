//! Selection of the force and response channels of a recording.

use quietcut_model::structure::Direction;
use quietcut_recording::{Channel, Quantity, Recording, RecordingError, Sidecar};

use super::FrfError;

/// Force and response channels of one recording, for the measurement of FRFs.
#[derive(Clone, Debug)]
pub(super) struct TestChannels<'a> {
    /// The recording.
    pub(super) recording: &'a Recording,
    /// Force channels with their directions, in the order x, y, z.
    pub(super) forces: Vec<(Direction, &'a Channel)>,
    /// Response channels, in the order x, y, z.
    pub(super) responses: Vec<Response<'a>>,
    /// Warnings for the user: one for each direction with several response channels, of which only one is used.
    pub(super) warnings: Vec<String>,
}

/// One response channel with its direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Response<'a> {
    pub(super) direction: Direction,
    pub(super) channel: &'a Channel,
    /// Order of the time derivative of displacement that the channel measures: 0 displacement, 1 velocity, 2
    /// acceleration.
    pub(super) derivatives: i32,
}

impl<'a> TestChannels<'a> {
    /// Selects forces and responses. If `chosen` names force channels, only these count as forces; if it names other
    /// channels, only these count as responses.
    ///
    /// Forces are those of fx, fy and fz that the sidecar names as inputs; if it names no inputs, those that are not
    /// constant. Of several response channels in one direction, displacement takes precedence over velocity, and
    /// velocity over acceleration.
    ///
    /// # Errors
    /// No force or no response is left; a chosen channel or an input does not exist; an input is not a force.
    pub(super) fn of(recording: &'a Recording, chosen: &[String]) -> Result<Self, FrfError> {
        let refused = |error: RecordingError| FrfError::Recording(error);
        for name in chosen {
            if recording.channel(name).is_none() {
                return Err(refused(recording.lacks(format!("channel \"{name}\""))));
            }
        }
        let is_chosen = |channel: &Channel, of: Quantity| {
            let of_this_kind = |name: &String| {
                let other = recording.channel(name).map(|channel| channel.quantity);
                other.is_some_and(|other| (other == Quantity::Force) == (of == Quantity::Force))
            };
            !chosen.iter().any(of_this_kind) || chosen.contains(&channel.name)
        };
        let (responses, warnings) = responses(recording, is_chosen);
        let channels = Self {
            forces: forces(recording, is_chosen)?,
            responses,
            recording,
            warnings,
        };
        if channels.forces.is_empty() {
            let asked = asked(recording, channels.responses.is_empty());
            return Err(refused(
                recording.lacks(format!("force fx, fy or fz that drives it{asked}")),
            ));
        }
        if channels.responses.is_empty() {
            let asked = asked(recording, true);
            return Err(refused(recording.lacks(format!(
                "response: a displacement x, y, z, a velocity vx … or an acceleration ax …{asked}"
            ))));
        }
        Ok(channels)
    }

    /// Directions of the forces.
    pub(super) fn force_directions(&self) -> Vec<Direction> {
        self.forces.iter().map(|(direction, _)| *direction).collect()
    }

    /// Direction and [`Response::derivatives`] of each selected response channel.
    pub(super) fn response_kinds(&self) -> Vec<(Direction, i32)> {
        self.responses
            .iter()
            .map(|response| (response.direction, response.derivatives))
            .collect()
    }

    /// Samples of each selected channel: the forces, followed by the responses.
    pub(super) fn signals(&self) -> Vec<&'a [f64]> {
        let forces = self.forces.iter().map(|(_, channel)| channel.samples.as_slice());
        let responses = self
            .responses
            .iter()
            .map(|response| response.channel.samples.as_slice());
        forces.chain(responses).collect()
    }

    /// The single force channel.
    ///
    /// # Errors
    /// Several forces are selected. `needed` names the kind of test for the message.
    pub(super) fn only_force(&self, needed: &str) -> Result<&'a Channel, FrfError> {
        match self.forces.as_slice() {
            [(_, channel)] => Ok(channel),
            several => {
                let names: Vec<&str> = several.iter().map(|(_, channel)| channel.name.as_str()).collect();
                Err(FrfError::Content {
                    path: self.recording.path.clone(),
                    what: format!(
                        "{} forces ({}), but {needed} needs one; say which by --channel, or by input in the sidecar",
                        names.len(),
                        names.join(", ")
                    ),
                })
            }
        }
    }
}

/// The option that would state what the channels without a meaning are; empty without such channels.
fn asked(recording: &Recording, needs_response: bool) -> String {
    let is_open = |channel: &&Channel| {
        let is_unstated = matches!(
            channel.quantity,
            Quantity::Unknown | Quantity::Voltage | Quantity::Level
        );
        is_unstated
            && !["tacho", "time", "rpm"].contains(&channel.name.as_str())
            && Quantity::of_name(&channel.name).is_none()
    };
    let has_force = recording
        .channels
        .iter()
        .any(|channel| channel.quantity == Quantity::Force);
    let force = (!has_force).then_some(("fx", "N", "2.2 mV/N"));
    let response = needs_response.then_some(("ax", "m/s^2", "10 mV/g"));
    let wanted = force.into_iter().chain(response);
    let map: Vec<String> = recording
        .channels
        .iter()
        .filter(is_open)
        .zip(wanted)
        .map(|(channel, (name, unit, sensitivity))| match channel.quantity {
            Quantity::Voltage => format!("{}={name}:{sensitivity}", channel.name),
            _ => format!("{}={name}:{unit}", channel.name),
        })
        .collect();
    if map.is_empty() {
        String::new()
    } else {
        format!(
            " (--map \"{}\" with the columns, names and units that hold states it)",
            map.join(",")
        )
    }
}

fn forces(
    recording: &Recording,
    is_chosen: impl Fn(&Channel, Quantity) -> bool,
) -> Result<Vec<(Direction, &Channel)>, FrfError> {
    let inputs = recording.sidecar.input.as_deref();
    for name in inputs.unwrap_or_default() {
        let channel = recording.channel(name).ok_or_else(|| {
            let sidecar = Sidecar::path_of(&recording.path);
            FrfError::Recording(recording.lacks(format!(
                "channel \"{name}\" that input in {} names",
                sidecar.display()
            )))
        })?;
        if channel.quantity != Quantity::Force {
            return Err(FrfError::Content {
                path: recording.path.clone(),
                what: format!(
                    "it is driven by \"{name}\", which is {}; a receptance needs a force",
                    channel.quantity
                ),
            });
        }
    }
    let mut forces = Vec::new();
    for (direction, name) in AXES.into_iter().zip(["fx", "fy", "fz"]) {
        let Some(channel) = recording
            .channel(name)
            .filter(|channel| channel.quantity == Quantity::Force)
        else {
            continue;
        };
        let drives = match inputs {
            Some(names) => names.iter().any(|input| input == name),
            None => channel.samples.windows(2).any(|pair| pair[0] != pair[1]),
        };
        if drives && is_chosen(channel, Quantity::Force) {
            forces.push((direction, channel));
        }
    }
    Ok(forces)
}

const AXES: [Direction; 3] = [Direction::X, Direction::Y, Direction::Z];

fn responses<'a>(
    recording: &'a Recording,
    is_chosen: impl Fn(&Channel, Quantity) -> bool,
) -> (Vec<Response<'a>>, Vec<String>) {
    let (mut responses, mut warnings) = (Vec::new(), Vec::new());
    for direction in AXES {
        let found: Vec<Response<'a>> = [
            ("", Quantity::Displacement),
            ("v", Quantity::Velocity),
            ("a", Quantity::Acceleration),
        ]
        .into_iter()
        .zip(0..)
        .filter_map(|((prefix, quantity), derivatives)| {
            let channel = recording.channel(&format!("{prefix}{direction}"))?;
            (channel.quantity == quantity && is_chosen(channel, quantity)).then_some(Response {
                direction,
                channel,
                derivatives,
            })
        })
        .collect();
        if let [taken, others @ ..] = found.as_slice() {
            responses.push(*taken);
            let names: Vec<&str> = others.iter().map(|other| other.channel.name.as_str()).collect();
            if !names.is_empty() {
                warnings.push(format!(
                    "{} is taken for the response in {direction}, not {}; --channel chooses",
                    taken.channel.name,
                    names.join(", ")
                ));
            }
        }
    }
    (responses, warnings)
}
