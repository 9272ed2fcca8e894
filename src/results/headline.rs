//! The headline number of a camera: how many people are there now.
//!
//! It is the number of persons that the counts follow, while it is known, else the median of the
//! camera's last reports. All servers with one result store have the same number.

use std::{num::NonZeroUsize, sync::Arc, time::Duration};

use lookdown_common::OwnCameras;

use super::{Cameras, FollowedPersons, ReportId, ResultStore, StoredReport, Unreachable};

/// The reports of this time before the latest one, inclusively, have a part in the median.
pub const MEDIAN_WINDOW: Duration = Duration::from_secs(5);
/// Most reports of the median.
const MOST_REPORTS: usize = 500;

/// The origin of a headline number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HeadlineSource {
    /// The persons that `lookdown count` follows.
    Tracks,
    /// The median of the last reports.
    Median,
    /// No number: the camera is paused.
    Paused,
}

/// The headline number of a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Headline {
    /// The number of persons; `None` while the camera is paused.
    pub persons: Option<usize>,
    /// Its origin.
    pub source: HeadlineSource,
}

impl Headline {
    /// Returns the headline number of the camera with this latest report. `own` are the cameras of
    /// this process, which may be paused, and `followed` the numbers of the counts.
    ///
    /// # Errors
    /// [`Unreachable`].
    pub async fn for_latest(
        store: &dyn ResultStore,
        latest: &StoredReport,
        own: &OwnCameras,
        followed: &FollowedPersons,
    ) -> Result<Self, Unreachable> {
        if own.is_paused(&latest.report.camera) {
            return Ok(Self {
                persons: None,
                source: HeadlineSource::Paused,
            });
        }
        if let Some(persons) = followed.at(&latest.report.camera) {
            return Ok(Self {
                persons: Some(persons),
                source: HeadlineSource::Tracks,
            });
        }
        let camera = Cameras::One(latest.report.camera.clone());
        let most = NonZeroUsize::new(MOST_REPORTS).unwrap_or(NonZeroUsize::MIN);
        let after = ReportId::at(latest.id.time() - MEDIAN_WINDOW);
        let reports = store.since(&camera, after, most).await?;
        let is_counted = |report: &&Arc<StoredReport>| report.id <= latest.id;
        let counted = reports.iter().filter(is_counted);
        let persons = median(counted.map(|report| report.report.persons));
        Ok(Self {
            persons: persons.or(Some(latest.report.persons)),
            source: HeadlineSource::Median,
        })
    }
}

impl HeadlineSource {
    /// The name in the API.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Tracks => "tracks",
            Self::Median => "median",
            Self::Paused => "paused",
        }
    }
}

/// Returns the median of each report and those before it in the window, in the order of the
/// reports.
#[must_use]
pub fn medians(reports: &[Arc<StoredReport>]) -> Vec<usize> {
    let mut first = 0;
    let medians = reports.iter().enumerate().map(|(index, report)| {
        let from = ReportId::at(report.id.time() - MEDIAN_WINDOW);
        while reports[first].id <= from {
            first += 1;
        }
        let counted = reports[first..=index].iter();
        median(counted.map(|report| report.report.persons)).unwrap_or_default()
    });
    medians.collect()
}

/// Returns the median; the lower one of two in the middle.
fn median(numbers: impl Iterator<Item = usize>) -> Option<usize> {
    let mut numbers: Vec<usize> = numbers.collect();
    numbers.sort_unstable();
    let middle = numbers.len().checked_sub(1)? / 2;
    numbers.get(middle).copied()
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use jiff::Timestamp;

    use super::*;
    use crate::{
        metrics::Metrics,
        results::{MemoryResults, NewReport, ResultLimits},
    };

    fn store_of(numbers: &[usize]) -> (MemoryResults, Arc<StoredReport>) {
        let store = MemoryResults::new(ResultLimits::default(), Arc::new(Metrics::default()));
        let reports = numbers.iter().map(|&persons| {
            let report = NewReport {
                camera: "hall".to_owned(),
                received_at: Timestamp::now(),
                persons,
                json: Bytes::from_static(b"{}"),
            };
            store.store(report, None)
        });
        let latest = reports.last().unwrap();
        (store, latest)
    }

    async fn headline(
        store: &MemoryResults,
        latest: &StoredReport,
        own: &OwnCameras,
        counted: Option<u64>,
    ) -> Headline {
        let followed = FollowedPersons::default();
        followed.set(move |camera| counted.filter(|_| camera == "hall"));
        Headline::for_latest(store, latest, own, &followed)
            .await
            .unwrap()
    }

    #[tokio::test]
    async fn headline_is_the_median_of_the_last_reports() {
        for (numbers, expected) in [
            (&[3][..], 3),
            (&[3, 9], 3),
            (&[3, 9, 4], 4),
            (&[0, 0, 7, 0, 8], 0),
            (&[5, 5, 8, 5, 14, 5, 3], 5),
        ] {
            let (store, latest) = store_of(numbers);
            let headline = headline(&store, &latest, &OwnCameras::default(), None).await;
            assert_eq!(headline.persons, Some(expected), "{numbers:?}");
            assert_eq!(headline.source, HeadlineSource::Median);
            let reports = store.since(&Cameras::All, ReportId::default(), NonZeroUsize::MAX);
            assert_eq!(medians(&reports.await.unwrap()).last(), Some(&expected));
        }
    }

    #[tokio::test]
    async fn paused_camera_has_no_number_and_others_the_followed_one() {
        let (store, latest) = store_of(&[7, 7, 7]);
        let own = OwnCameras::default();
        for (is_paused, persons, source) in [(true, None, "paused"), (false, Some(5), "tracks")] {
            own.set([("hall".to_owned(), is_paused)].into());
            let headline = headline(&store, &latest, &own, Some(5)).await;
            assert_eq!(
                (headline.persons, headline.source.name()),
                (persons, source)
            );
        }
    }
}
