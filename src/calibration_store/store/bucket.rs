//! A bucket of an object store: S3 and what speaks like it, Google Cloud Storage, Azure Blob
//! Storage. An object's `ETag` is its stamp, so that one request per poll finds all changes.

mod background;
mod bounded;
mod connection;
mod failure;
mod listing;

use std::sync::Arc;

use object_store::{
    Error, ObjectMeta, ObjectStoreExt, PutMode, PutOptions, UpdateVersion,
    list::PaginatedListOptions, path::Path,
};
use url::Url;

use self::{background::Background, connection::Objects};
use super::{CalibrationStore, ListedFile, MAX_FILES, Replaces, StoreError};

/// Most pages of a listing: some may hold nothing but deeper levels.
const MAX_PAGES: usize = 500;
/// The separator of the levels of a bucket.
const LEVEL: &str = "/";

/// A bucket, or one level of it. Credentials come from the variables of its provider.
#[derive(Debug)]
pub struct BucketStore {
    /// The address, which holds no secrets.
    place: String,
    objects: Arc<dyn Objects>,
    level: Path,
    background: Background,
}

impl BucketStore {
    /// The bucket at `url`, such as `s3://bucket/calibrations`, as the environment variables
    /// `variables` of its provider say: `AWS_ENDPOINT`, `AZURE_STORAGE_ACCOUNT_KEY` and the like.
    /// Nothing is sent yet.
    ///
    /// # Errors
    /// [`StoreError::Failed`] when the URL is that of no bucket, or the variables of its provider
    /// cannot be used.
    pub fn new(
        url: &Url,
        variables: impl Iterator<Item = (String, String)>,
    ) -> Result<Self, StoreError> {
        let place = url.as_str().trim_end_matches('/').to_owned();
        let failed = |problem: String| StoreError::Failed {
            place: place.clone(),
            problem,
        };
        let (objects, level) = connection::to(url, variables).map_err(failed)?;
        let background =
            Background::start("calibration-bucket").map_err(|error| failed(error.to_string()))?;
        Ok(Self {
            place,
            objects,
            level,
            background,
        })
    }

    /// Does `work` off this thread and waits for it.
    fn wait<T: Send + 'static>(
        &self,
        work: impl Future<Output = Result<T, Error>> + Send + 'static,
    ) -> Result<T, StoreError> {
        let outcome = self.background.wait(work).ok_or_else(|| self.given_up())?;
        outcome.map_err(|error| failure::of(&self.place, &error))
    }

    fn given_up(&self) -> StoreError {
        StoreError::Failed {
            place: self.place.clone(),
            problem: "a request was given up because of a fault of ours".to_owned(),
        }
    }
}

impl CalibrationStore for BucketStore {
    fn place(&self) -> String {
        self.place.clone()
    }

    fn list(&self) -> Result<Vec<ListedFile>, StoreError> {
        let found = self.wait(list(Arc::clone(&self.objects), self.level.clone()))?;
        if found.len() > MAX_FILES {
            return Err(StoreError::Failed {
                place: self.place(),
                problem: format!("there are more than {MAX_FILES} objects"),
            });
        }
        let files = found.iter().filter_map(|object| {
            // One level only; the level itself may be an object, too.
            let mut below = object.location.prefix_match(&self.level)?;
            let (name, deeper) = (below.next()?, below.next());
            deeper.is_none().then(|| ListedFile {
                name: name.as_ref().to_owned(),
                stamp: stamp(object),
            })
        });
        Ok(files.collect())
    }

    fn read(&self, names: &[&str], at_most: usize) -> Vec<Result<Vec<u8>, StoreError>> {
        let reads: Vec<_> = names
            .iter()
            .map(|name| {
                let path = self.level.clone().join(*name);
                read(Arc::clone(&self.objects), path, at_most as u64)
            })
            .collect();
        let side_by_side = self.background.wait(async {
            let begun: Vec<_> = reads.into_iter().map(tokio::spawn).collect();
            let mut contents = Vec::new();
            for content in begun {
                contents.push(content.await.unwrap_or_else(|fault| Err(fault.into())));
            }
            contents
        });
        match side_by_side {
            Some(contents) => contents
                .into_iter()
                .map(|content| content.map_err(|error| failure::of(&self.place, &error)))
                .collect(),
            None => names.iter().map(|_| Err(self.given_up())).collect(),
        }
    }

    fn write(&self, name: &str, content: &[u8], replaces: Replaces<'_>) -> Result<(), StoreError> {
        let path = self.level.clone().join(name);
        let replaces = Expected::from(replaces);
        let written = write(Arc::clone(&self.objects), path, content.to_vec(), replaces);
        match self.wait(written)? {
            Written::Yes => Ok(()),
            Written::Outdated => Err(StoreError::Changed {
                place: self.place(),
                name: name.to_owned(),
            }),
        }
    }

    fn delete(&self, name: &str) -> Result<(), StoreError> {
        let (objects, path) = (Arc::clone(&self.objects), self.level.clone().join(name));
        self.wait(async move {
            match objects.delete(&path).await {
                Err(Error::NotFound { .. }) => Ok(()),
                deleted => deleted,
            }
        })
    }
}

/// The objects of one level, page by page, until there are more than [`MAX_FILES`].
async fn list(objects: Arc<dyn Objects>, level: Path) -> Result<Vec<ObjectMeta>, Error> {
    let prefix = (!level.is_root()).then(|| format!("{level}{LEVEL}"));
    let (mut found, mut page_token) = (Vec::new(), None);
    for _ in 0..MAX_PAGES {
        let options = PaginatedListOptions {
            delimiter: Some(LEVEL.into()),
            page_token,
            ..PaginatedListOptions::default()
        };
        let page = objects.list_paginated(prefix.as_deref(), options).await?;
        found.extend(page.result.objects);
        page_token = page.page_token;
        if page_token.is_none() || found.len() > MAX_FILES {
            return Ok(found);
        }
    }
    Err(Error::Generic {
        store: "bucket",
        source: format!("the listing has more than {MAX_PAGES} pages").into(),
    })
}

async fn read(objects: Arc<dyn Objects>, path: Path, at_most: u64) -> Result<Vec<u8>, Error> {
    let content = match objects.get(&path).await {
        Ok(answer) if answer.meta.size <= at_most => answer.bytes().await?,
        Err(error) if !bounded::is_too_large(&error) => return Err(error),
        // The body of a larger one is not waited for.
        _ => objects.get_range(&path, 0..at_most).await?,
    };
    Ok(content.into())
}

/// [`Replaces`] that outlives the call.
enum Expected {
    Anything,
    Nothing,
    Stamp(String),
}

impl From<Replaces<'_>> for Expected {
    fn from(replaces: Replaces<'_>) -> Self {
        match replaces {
            Replaces::Anything => Self::Anything,
            Replaces::Nothing => Self::Nothing,
            Replaces::Stamp(stamp) => Self::Stamp(stamp.to_owned()),
        }
    }
}

/// The outcome of a conditional write.
enum Written {
    Yes,
    Outdated,
}

/// Writes where the store can under a condition; a store that cannot is only asked beforehand.
async fn write(
    objects: Arc<dyn Objects>,
    path: Path,
    content: Vec<u8>,
    expected: Expected,
) -> Result<Written, Error> {
    let now = match objects.head(&path).await {
        Err(Error::NotFound { .. }) => None,
        now => Some(now?),
    };
    let mode = match (expected, now) {
        (Expected::Anything, _) => PutMode::Overwrite,
        (Expected::Nothing, None) => PutMode::Create,
        (Expected::Stamp(expected), Some(now)) if stamp(&now) == expected => {
            PutMode::Update(UpdateVersion {
                e_tag: now.e_tag,
                version: now.version,
            })
        }
        _ => return Ok(Written::Outdated),
    };
    let put = async |mode: PutMode| {
        let content = content.clone().into();
        objects
            .put_opts(&path, content, PutOptions::from(mode))
            .await
    };
    let written = match put(mode).await {
        Err(Error::NotImplemented { .. } | Error::NotSupported { .. }) => {
            put(PutMode::Overwrite).await
        }
        written => written,
    };
    match written {
        Err(Error::AlreadyExists { .. } | Error::Precondition { .. }) => Ok(Written::Outdated),
        written => written.map(|_| Written::Yes),
    }
}

/// Returns the stamp of an object's content. Listings and answers write `ETag`s with and without
/// quotes, and moments with and without fractions of a second.
fn stamp(object: &ObjectMeta) -> String {
    object.e_tag.as_ref().map_or_else(
        || format!("{}:{}", object.size, object.last_modified.timestamp()),
        |tag| tag.trim_matches('"').to_owned(),
    )
}
