//! The rows of `GET /cameras`.

use std::sync::Arc;

use lookdown_common::ConfigError;
use serde::Serialize;
use utoipa::ToSchema;

use super::suggestion::{self, SuggestionState};
use crate::{
    api::{
        ApiState,
        http::{
            deadline::{CAMERAS, Deadline},
            problem::Problem,
        },
    },
    cameras::Cameras,
};

/// A camera and its state.
#[derive(Default, Serialize, ToSchema)]
pub(in crate::api) struct CameraInfo {
    /// The name.
    pub(super) name: String,
    /// The source, without password and query.
    source: String,
    /// `true` if the camera can be changed and deleted here, `false` if it is one of the settings.
    stored: bool,
    /// `true` if no frames are read. A change takes about two seconds.
    paused: bool,
    /// `true` if the latest image is kept, by the camera or by the setting `results.images`.
    keep_image: bool,
    /// The user name of a stored camera.
    user: Option<String>,
    /// The interval of a stored camera.
    every: Option<String>,
    /// The calibration of a stored camera.
    calibration: Option<String>,
    /// The profile of a stored camera.
    profile: Option<String>,
    /// Time since the last whole frame, or since the start without a frame.
    last_frame_age_seconds: Option<f64>,
    /// Frames per second that the settings want, in the last whole minute.
    wanted_rate: Option<f64>,
    /// Frames per second with a report, in the last whole minute.
    reached_rate: Option<f64>,
    /// The profile and the rate in use, with the time of a search that they were chosen by.
    choice: Option<String>,
    /// The reason and the remedies, if less than 80 % of the wanted rate is reached, if the machine
    /// is too slow for counts, or if reports are not counted.
    warning: Option<String>,
    /// The reason why there are no frames.
    problem: Option<String>,
    /// `GET /cameras/{camera}/suggested-calibration`; `null` if it needs none or had no frame.
    suggestion: Option<SuggestionState>,
}

/// Returns all cameras by name.
pub(super) async fn rows(
    state: &ApiState,
    cameras: Arc<Cameras>,
    deadline: Deadline,
) -> Result<Vec<CameraInfo>, Problem> {
    let read = move || {
        let stored = cameras.stored()?;
        let paused = cameras.paused_of_settings()?;
        Ok((cameras.states(&stored), stored, paused, cameras.problems()))
    };
    let read = deadline.using(&CAMERAS, move || {
        read().map_err(|error: ConfigError| Problem::internal(error))
    });
    let (states, stored, paused, problems) = read.await?;
    let mut rows: Vec<_> = states
        .into_iter()
        .map(|state| CameraInfo {
            choice: state.choice.map(|choice| choice.to_string()),
            warning: state.warning,
            wanted_rate: state.rate.map(|rate| rate.wanted),
            reached_rate: state.rate.map(|rate| rate.reached),
            last_frame_age_seconds: Some(state.last_frame_age.as_secs_f64()),
            problem: state.problem,
            name: state.name,
            source: state.source,
            ..CameraInfo::default()
        })
        .collect();
    for (name, source) in paused {
        // A camera that has just been paused may still be watched.
        let row = row_of(&mut rows, &name);
        row.paused = row.last_frame_age_seconds.is_none();
        row.source = source;
    }
    for (name, problem) in problems {
        let row = row_of(&mut rows, &name);
        (row.stored, row.problem) = (true, Some(problem));
    }
    for (name, camera) in stored {
        let row = row_of(&mut rows, &name);
        row.source = camera.shown_source();
        row.stored = true;
        row.paused = camera.paused && row.last_frame_age_seconds.is_none();
        row.user = camera.user;
        row.every = camera.every;
        row.calibration = camera.calibration;
        row.profile = camera.profile;
    }
    for row in &mut rows {
        row.keep_image = state.keeps_image(&row.name);
        row.suggestion = suggestion::state_of(state, &row.name);
        let of_counts = || state.options.companions.count_warning(&row.name);
        let of_counts = || (!row.paused).then(of_counts).flatten();
        row.warning = row.warning.take().or_else(of_counts);
    }
    rows.sort_unstable_by(|one, other| one.name.cmp(&other.name));
    Ok(rows)
}

/// Returns the row of a camera, a new one if there is none.
fn row_of<'a>(rows: &'a mut Vec<CameraInfo>, name: &str) -> &'a mut CameraInfo {
    let index = rows.iter().position(|row| row.name == name);
    let index = index.unwrap_or(rows.len());
    if index == rows.len() {
        rows.push(CameraInfo {
            name: name.to_owned(),
            ..CameraInfo::default()
        });
    }
    &mut rows[index]
}
