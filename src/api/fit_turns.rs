//! The turns of fits, which take much longer than detections: one runs at a time, so that frames
//! find free workers.

use std::sync::Arc;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::http::problem::{Problem, ProblemKind};

/// Fits that run or wait.
const PLACES: usize = 3;

/// The places and the turn.
pub(super) struct FitTurns {
    places: Arc<Semaphore>,
    turn: Arc<Semaphore>,
}

/// A turn, until it is dropped.
pub(super) struct FitTurn {
    _place: OwnedSemaphorePermit,
    _turn: OwnedSemaphorePermit,
}

impl Default for FitTurns {
    fn default() -> Self {
        Self {
            places: Arc::new(Semaphore::new(PLACES)),
            turn: Arc::new(Semaphore::new(1)),
        }
    }
}

impl FitTurns {
    /// Waits for the end of the fits before.
    ///
    /// # Errors
    /// [`ProblemKind::Overloaded`] at once if all places are taken.
    pub(super) async fn next(&self) -> Result<FitTurn, Problem> {
        let place = Arc::clone(&self.places).try_acquire_owned();
        let place = place.map_err(|_| {
            let detail = format!("{PLACES} fits run or wait: retry when they have ended");
            Problem::new(ProblemKind::Overloaded, detail)
        })?;
        let turn = Arc::clone(&self.turn).acquire_owned().await;
        Ok(FitTurn {
            _place: place,
            _turn: turn.map_err(|_| Problem::shutting_down())?,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::{
        future::Future,
        task::{Context, Poll, Waker},
    };

    use super::*;

    #[test]
    fn one_fit_runs_two_wait_and_a_fourth_is_refused() {
        let turns = FitTurns::default();
        let mut context = Context::from_waker(Waker::noop());
        let mut waiting = [(); 4].map(|()| Box::pin(turns.next()));
        let polled = waiting
            .each_mut()
            .map(|next| next.as_mut().poll(&mut context));
        let [
            Poll::Ready(Ok(running)),
            Poll::Pending,
            Poll::Pending,
            Poll::Ready(Err(refused)),
        ] = polled
        else {
            panic!("other turns");
        };
        assert_eq!(refused.kind, ProblemKind::Overloaded);
        drop(running);
        let second = waiting[1].as_mut().poll(&mut context);
        assert!(matches!(second, Poll::Ready(Ok(_))));
    }
}
