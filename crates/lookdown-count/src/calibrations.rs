//! The calibrations of the cameras, as the server has them.

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use lookdown_common::{ServerClient, read_body, text::one_line};
use lookdown_lens::calibration::{Calibration, CalibrationFile};
use reqwest::{StatusCode, header::ETAG};

use crate::{
    definition::CameraDefinition,
    definition_key::DefinitionKey,
    store::{Store, StoreError, StoredCalibrations},
};

/// Longest time for a calibration.
const TIMEOUT: Duration = Duration::from_secs(20);
/// Most calibrations in memory.
const MAX_CALIBRATIONS: usize = 1024;

/// The calibrations by ID.
pub(crate) struct Calibrations {
    known: BTreeMap<String, Known>,
}

/// A calibration, and the revision for which it was requested.
struct Known {
    /// The revision of the report that caused the request: the server may have a later one.
    requested: String,
    calibration: Option<Arc<Calibration>>,
}

/// The reason why a calibration is not known.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CalibrationProblem {
    #[error("{0}")]
    Server(String),
    #[error(transparent)]
    Store(#[from] StoreError),
}

impl Calibrations {
    /// Continues with the calibrations of the store.
    pub(crate) fn resumed(stored: StoredCalibrations) -> Self {
        let known = stored.into_iter().map(|(id, (requested, content))| {
            let calibration = content.and_then(|content| parse(&id, &content).ok());
            let known = Known {
                requested,
                calibration: calibration.map(Arc::new),
            };
            (id, known)
        });
        Self {
            known: known.collect(),
        }
    }

    /// Returns the definition of a key with what is known.
    pub(crate) fn definition(&self, key: DefinitionKey) -> Arc<CameraDefinition> {
        let known = key.calibration.as_ref().and_then(|id| self.known.get(id));
        let calibration = known.and_then(|known| known.calibration.as_ref());
        Arc::new(match calibration {
            Some(calibration) => CameraDefinition::new(key, calibration),
            None => CameraDefinition::without_calibration(key),
        })
    }

    /// Requests the calibration of a key unless its revision is known.
    pub(crate) async fn update(
        &mut self,
        client: &ServerClient,
        store: &Store,
        key: &DefinitionKey,
    ) -> Result<(), CalibrationProblem> {
        let Some(id) = &key.calibration else {
            return Ok(());
        };
        let known = self.known.get(id);
        if known.is_some_and(|known| known.requested == key.revision) {
            return Ok(());
        }
        let content = request(client, id)
            .await
            .map_err(CalibrationProblem::Server)?;
        let calibration = match &content {
            Some(content) => match parse(id, content) {
                Ok(calibration) => Some(Arc::new(calibration)),
                Err(problem) => {
                    tracing::warn!("the calibration {id} of the server is not used: {problem}");
                    None
                }
            },
            None => None,
        };
        let (store, id, revision) = (store.clone(), id.clone(), key.revision.clone());
        let stored_id = id.clone();
        let stored = tokio::task::spawn_blocking(move || {
            store.put_calibration(&stored_id, &revision, content.as_deref())
        });
        // A task that panicked is logged by the panic hook.
        stored.await.unwrap_or(Ok(()))?;
        if self.known.len() >= MAX_CALIBRATIONS && !self.known.contains_key(&id) {
            self.known.pop_first();
        }
        let known = Known {
            requested: key.revision.clone(),
            calibration,
        };
        self.known.insert(id, known);
        Ok(())
    }
}

/// Requests a calibration in the native format; `None` if the server has none with this ID.
async fn request(client: &ServerClient, id: &str) -> Result<Option<Vec<u8>>, String> {
    let url = client.route(["calibrations", id]);
    let sent = client.get(url).timeout(TIMEOUT).send().await;
    let response = sent.map_err(|error| client.failure(error))?;
    match response.status() {
        StatusCode::OK => {
            let has_tag = response.headers().contains_key(ETAG);
            let body = read_body(response, CalibrationFile::MAX_BYTES).await;
            let body = body.map_err(|error| client.failure(error))?;
            if has_tag {
                Ok(Some(body))
            } else {
                let address = client.address();
                Err(format!("{address} is no Lookdown server: check server.url"))
            }
        }
        StatusCode::NOT_FOUND => Ok(None),
        _ => Err(client.refusal(response).await),
    }
}

fn parse(id: &str, content: &[u8]) -> Result<Calibration, String> {
    let file = CalibrationFile::parse(content).map_err(|problem| one_line(&problem.to_string()))?;
    let first = file.calibrations(id, content).into_iter().next();
    let (_, calibration) = first.ok_or_else(|| "it has no camera".to_owned())?;
    calibration.map_err(|problem| one_line(&problem.to_string()))
}
