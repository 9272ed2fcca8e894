//! A measurement of one way to run the network.

use std::{
    num::NonZeroUsize,
    sync::Arc,
    time::{Duration, Instant},
};

use lookdown_detect::{
    imaging::ViewBatch,
    inference::{InferenceError, Model},
    parameters::Profile,
};

use crate::{
    app::{Assembly, assemble},
    settings::Settings,
};

/// The duration of one measurement.
const WINDOW: Duration = Duration::from_millis(1500);

/// One way to run the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Choice {
    /// The number of concurrent sessions.
    pub(super) sessions: NonZeroUsize,
    /// The number of threads of each.
    pub(super) threads: NonZeroUsize,
    /// The number of views of one run.
    pub(super) batch_views: NonZeroUsize,
}

/// A model loaded for one choice.
pub(super) struct Trial {
    model: Arc<Model>,
    choice: Choice,
}

impl Trial {
    /// Loads the profile's model for this choice and runs it once.
    pub(super) fn prepare(
        settings: &Settings,
        profile: Profile,
        choice: Choice,
    ) -> anyhow::Result<Self> {
        let mut settings = settings.clone();
        settings.threads.sessions = choice.sessions;
        settings.threads.per_session = choice.threads;
        settings.threads.batch_views = choice.batch_views;
        let Assembly { engine, models, .. } = assemble(&settings)?;
        let model = models.load(engine.default_models().of(profile))?;
        Ok(Self { model, choice })
    }

    /// The number of views that all sessions together process in a second.
    pub(super) fn views_per_second(&self) -> Result<f64, InferenceError> {
        std::thread::scope(|scope| {
            let sessions = 0..self.choice.sessions.get();
            let running: Vec<_> = sessions
                .map(|session| scope.spawn(move || self.rate_of(session)))
                .collect();
            let rates = running.into_iter().map(|session| {
                let panicked = |_| Err(InferenceError::Run("it panicked".to_owned()));
                session.join().unwrap_or_else(panicked)
            });
            rates.sum()
        })
    }

    fn rate_of(&self, session: usize) -> Result<f64, InferenceError> {
        let views = self.model.batch_of(self.choice.batch_views).get();
        let mut batch = ViewBatch::default();
        for slot in batch.prepare(views, self.model.input()) {
            slot.fill(0.5);
        }
        let began = Instant::now();
        let mut runs = 0.0;
        while began.elapsed() < WINDOW {
            self.model.detect(session, &batch)?;
            runs += 1.0;
        }
        #[expect(
            clippy::cast_precision_loss,
            reason = "there are far fewer than 2^52 views"
        )]
        let views = runs * views as f64;
        Ok(views / began.elapsed().as_secs_f64())
    }
}
