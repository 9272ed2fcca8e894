//! Persons who come back: a new track that continues a lost one.
//!
//! A person who sits at the rim is missed for a minute, and a person who walks is hidden for some
//! seconds. Such a track ends, as it must no longer count, and is kept for a while. When a new
//! track is confirmed, it may be the same person. The likelihood of its place, which spreads with
//! the time, is compared with the density of new persons.

use crate::{Track, TrackId, TrackerSettings};

/// Most tracks that wait.
const MAX_LOST: usize = 64;

/// Lets a track, if it is confirmed, continue the likeliest one that was not seen since it began.
pub(super) fn continue_lost(
    tracks: &mut Vec<Track>,
    lost: &mut Vec<Track>,
    new: TrackId,
    settings: &TrackerSettings,
) {
    let is_new = |track: &&Track| track.id == new && track.is_confirmed();
    let Some(mut track) = tracks.iter().find(is_new).cloned() else {
        return;
    };
    let earlier = tracks.iter().chain(lost.iter());
    let gains = earlier.map(|earlier| (likelihood(earlier, &track, settings), earlier));
    let Some((gain, earlier)) = gains.max_by(|(a, _), (b, _)| a.total_cmp(b)) else {
        return;
    };
    if gain > 0.0 {
        track.continue_from(earlier);
        let is_other = |other: &Track| ![new, track.id].contains(&other.id);
        tracks.retain(is_other);
        lost.retain(is_other);
        let at = tracks.partition_point(|other| other.id < track.id);
        tracks.insert(at, track);
    }
}

/// The logarithm of the ratio of "the person of this track is back" to "a new person".
fn likelihood(earlier: &Track, new: &Track, settings: &TrackerSettings) -> f64 {
    let absent_s = new.motion.at_s - earlier.seen_s;
    if !earlier.is_confirmed() || earlier.seen_s >= new.first_seen_s {
        return -1.0;
    }
    let innovation = earlier
        .motion
        .absence(&new.motion, absent_s, settings.absent_drift);
    innovation.log_density() - settings.arrival_density.ln()
}

/// Keeps the confirmed tracks that ended, for a while.
pub(super) fn keep_lost(lost: &mut Vec<Track>, ended: &[Track], now_s: f64, max_absent_s: f64) {
    lost.extend(ended.iter().filter(|track| track.is_confirmed()).cloned());
    lost.retain(|track| now_s - track.seen_s <= max_absent_s);
    let over = lost.len().saturating_sub(MAX_LOST);
    lost.drain(..over);
}
