//! Two tracks of one person: cameras of a site that place the person differently.

use crate::Track;

/// Tracks nearer than this may be one person, meters.
const MERGE_DISTANCE_M: f64 = 0.8;
/// Squared Mahalanobis distance up to which they may be: the 99 % quantile of the chi-squared
/// distribution with two degrees of freedom.
const MERGE_GATE: f64 = 9.21;
/// A camera that saw both within this time holds them apart, seconds.
const SEPARATE_S: f64 = 3.0;

/// Removes and returns the younger one of each two tracks that no camera saw as two persons.
pub(super) fn end_duplicates(tracks: &mut Vec<Track>, now_s: f64) -> Vec<Track> {
    let mut ended = Vec::new();
    let mut younger = 0;
    while younger < tracks.len() {
        let is_duplicate = tracks[..younger]
            .iter()
            .any(|older| are_one_person(older, &tracks[younger], now_s));
        if is_duplicate {
            ended.push(tracks.remove(younger));
        } else {
            younger += 1;
        }
    }
    ended
}

fn are_one_person(a: &Track, b: &Track, now_s: f64) -> bool {
    let recently = |track: &Track, camera: &usize| {
        let seen = track.seen_by.get(camera);
        seen.is_some_and(|&at_s| now_s - at_s <= SEPARATE_S)
    };
    if a.seen_by
        .keys()
        .any(|camera| recently(a, camera) && recently(b, camera))
    {
        return false;
    }
    let at_s = a.motion.at_s.max(b.motion.at_s);
    a.motion.separation(&b.motion, at_s).is_some_and(|between| {
        between.residual.norm() < MERGE_DISTANCE_M && between.squared_distance() < MERGE_GATE
    })
}
