//! The headline number of a camera: how many people are there now, with its error bar.
//!
//! With enough reference counts, it is the number that they teach. Else it is the number of persons
//! that the counts follow, while it is known, and else that of the reports. Numbers of reports are
//! medians. Without reference counts, all servers with one result store have the same number.
//!
//! The numbers of persons that the counts follow.

use std::{num::NonZeroUsize, sync::Arc, time::Duration};

use lookdown_common::OwnCameras;
use lookdown_tracking::taught::{NumberWithBar, TaughtNumber};
use parking_lot::RwLock;

use super::{Cameras, ReportId, ResultStore, StoredReport, Unreachable};
use crate::reference_counts::ReferenceCounts;

/// The reports of this time before the latest one, inclusively, have a part in the median.
pub const MEDIAN_WINDOW: Duration = Duration::from_secs(5);
/// Most reports of the median.
const MOST_REPORTS: usize = 500;

/// The origin of a headline number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, strum::IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum HeadlineSource {
    /// The median of the last reports, with the threshold of the camera.
    Taught,
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
    /// The number of persons with its bar; `None` while the camera is paused.
    pub number: Option<NumberWithBar>,
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
        references: &ReferenceCounts,
    ) -> Result<Self, Unreachable> {
        let camera = &latest.report.camera;
        if own.is_paused(camera) {
            return Ok(Self {
                number: None,
                source: HeadlineSource::Paused,
            });
        }
        let taught = references.number(camera);
        let taught = taught.filter(|_| latest.report.scores.is_some());
        if taught.is_none()
            && let Some(persons) = followed.at(camera)
        {
            return Ok(Self {
                number: Some(NumberWithBar::untaught(persons)),
                source: HeadlineSource::Tracks,
            });
        }
        let most = NonZeroUsize::new(MOST_REPORTS).unwrap_or(NonZeroUsize::MIN);
        let after = ReportId::at(latest.id.time() - MEDIAN_WINDOW);
        let camera = Cameras::One(camera.clone());
        let reports = store.since(&camera, after, most).await?;
        let counted = reports.iter().filter(|report| report.id <= latest.id);
        let numbers: Vec<_> = counted
            .map(|report| number(report, taught.as_deref()))
            .collect();
        let source = match taught {
            Some(_) => HeadlineSource::Taught,
            None => HeadlineSource::Median,
        };
        let number = median(&numbers).unwrap_or_else(|| number(latest, taught.as_deref()));
        Ok(Self {
            number: Some(number),
            source,
        })
    }
}

/// Returns the median of each report and those before it in the window, in the order of the
/// reports.
pub fn medians(reports: &[Arc<StoredReport>], taught: Option<&TaughtNumber>) -> Vec<NumberWithBar> {
    let numbers: Vec<_> = reports
        .iter()
        .map(|report| number(report, taught))
        .collect();
    let mut first = 0;
    let medians = reports.iter().enumerate().map(|(index, report)| {
        let from = ReportId::at(report.id.time() - MEDIAN_WINDOW);
        while reports[first].id <= from {
            first += 1;
        }
        median(&numbers[first..=index]).unwrap_or(numbers[index])
    });
    medians.collect()
}

/// Returns the number of one report.
fn number(report: &StoredReport, taught: Option<&TaughtNumber>) -> NumberWithBar {
    match (taught, &report.report.scores) {
        (Some(taught), Some(scores)) => taught.number(scores),
        _ => NumberWithBar::untaught(report.report.persons),
    }
}

/// Returns the medians of the numbers and of the ends of the bars; the lower one of two in the
/// middle.
fn median(numbers: &[NumberWithBar]) -> Option<NumberWithBar> {
    let middle = numbers.len().checked_sub(1)? / 2;
    let of = |value: fn(&NumberWithBar) -> usize| {
        let mut values: Vec<_> = numbers.iter().map(value).collect();
        values.sort_unstable();
        values[middle]
    };
    Some(NumberWithBar {
        persons: of(|number| number.persons),
        low: of(|number| number.low),
        high: of(|number| number.high),
    })
}

/// Returns the number of a camera; `None` while it is unknown.
type Source = Arc<dyn Fn(&str) -> Option<u64> + Send + Sync>;

/// The persons that the counts of this process or of `counts.url` follow, if there are any. Clones
/// share them.
#[derive(Clone, Default)]
pub struct FollowedPersons(Arc<RwLock<Option<Source>>>);

impl FollowedPersons {
    /// Replaces the source of the numbers.
    pub fn set(&self, source: impl Fn(&str) -> Option<u64> + Send + Sync + 'static) {
        *self.0.write() = Some(Arc::new(source));
    }

    /// Returns the number of a camera; `None` while it is unknown.
    pub fn at(&self, camera: &str) -> Option<usize> {
        let source = self.0.read().clone()?;
        usize::try_from(source(camera)?).ok()
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use jiff::Timestamp;

    use super::*;
    use crate::{
        metrics::Metrics,
        reference_counts::ReferenceCount,
        results::{MemoryResults, NewReport, ResultLimits},
    };

    fn store_of(numbers: &[usize]) -> (MemoryResults, Arc<StoredReport>) {
        let store = MemoryResults::new(ResultLimits::default(), Arc::new(Metrics::default()));
        let reports = numbers.iter().map(|&persons| {
            let report = NewReport {
                camera: "hall".to_owned(),
                received_at: Timestamp::now(),
                persons,
                // Boxes below the threshold: as many persons again.
                scores: Some([vec![0.9; persons], vec![0.1; persons]].concat()),
                json: Bytes::from_static(b"{}"),
            };
            store.store(report, None)
        });
        let latest = reports.last().unwrap();
        (store, latest)
    }

    async fn headline_of(
        store: &MemoryResults,
        latest: &StoredReport,
        own: &OwnCameras,
        counted: Option<u64>,
    ) -> Headline {
        let references = ReferenceCounts::default();
        Headline::for_latest(store, latest, own, &followed(counted), &references)
            .await
            .unwrap()
    }

    fn followed(counted: Option<u64>) -> FollowedPersons {
        let followed = FollowedPersons::default();
        followed.set(move |camera| counted.filter(|_| camera == "hall"));
        followed
    }

    fn persons(headline: Headline) -> Option<usize> {
        Some(headline.number?.persons)
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
            let headline = headline_of(&store, &latest, &OwnCameras::default(), None).await;
            assert_eq!(persons(headline), Some(expected), "{numbers:?}");
            let NumberWithBar { low, high, .. } = headline.number.unwrap();
            assert!(low <= expected && expected <= high && low < high);
            assert_eq!(headline.source, HeadlineSource::Median);
            let reports = store.since(&Cameras::All, ReportId::default(), NonZeroUsize::MAX);
            let medians = medians(&reports.await.unwrap(), None);
            assert_eq!(medians.last(), headline.number.as_ref());
        }
    }

    #[tokio::test]
    async fn paused_camera_has_no_number_and_others_the_followed_one() {
        let (store, latest) = store_of(&[7, 7, 7]);
        let own = OwnCameras::default();
        for (is_paused, expected, source) in [(true, None, "paused"), (false, Some(5), "tracks")] {
            own.set([("hall".to_owned(), is_paused)].into());
            let headline = headline_of(&store, &latest, &own, Some(5)).await;
            assert_eq!(
                (persons(headline), <&str>::from(headline.source)),
                (expected, source)
            );
        }
    }

    #[tokio::test]
    async fn five_reference_counts_replace_the_followed_number() {
        let (store, latest) = store_of(&[4, 4, 4]);
        let (references, own) = (ReferenceCounts::default(), OwnCameras::default());
        let now = Timestamp::now();
        for persons in 1..6_u8 {
            let scores = [vec![0.9; persons.into()], vec![0.1; persons.into()]].concat();
            let told = ReferenceCount {
                report: persons.to_string(),
                at: now,
                persons: 2 * u32::from(persons),
                scores,
            };
            references.put("hall", told, now).unwrap();
            let followed = followed(Some(4));
            let headline = Headline::for_latest(&store, &latest, &own, &followed, &references);
            let headline = headline.await.unwrap();
            let expected = if persons == 5 {
                (8, "taught")
            } else {
                (4, "tracks")
            };
            assert_eq!(
                (
                    headline.number.unwrap().persons,
                    <&str>::from(headline.source)
                ),
                expected
            );
        }
    }
}
