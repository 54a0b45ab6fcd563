//! Formats of serde: what is written is read again, whatever the format.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de::DeserializeOwned};

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Format {
    Json,
    Cbor,
    Bincode,
    Postcard,
}

/// Every format in turn.
pub const FORMATS: [Format; 4] = [
    Format::Json,
    Format::Cbor,
    Format::Bincode,
    Format::Postcard,
];

impl Format {
    pub fn write<T: Serialize>(self, value: &T) -> Result<Vec<u8>, String> {
        self.write_erased(Erased(value))
    }

    fn write_erased(self, value: Erased<&dyn erased_serde::Serialize>) -> Result<Vec<u8>, String> {
        match self {
            Format::Json => serde_json::to_vec(&value).map_err(|e| e.to_string()),
            Format::Cbor => {
                let mut bytes = Vec::new();
                let written = ciborium::into_writer(&value, &mut bytes);
                written.map(|()| bytes).map_err(|e| e.to_string())
            }
            Format::Bincode => bincode::serde::encode_to_vec(&value, bincode::config::standard())
                .map_err(|e| e.to_string()),
            Format::Postcard => postcard::to_allocvec(&value).map_err(|e| e.to_string()),
        }
    }

    pub fn read<T: DeserializeOwned>(self, bytes: &[u8]) -> Result<T, String> {
        self.read_within::<T, { 1 << 28 }>(bytes)
    }

    /// Reads what takes at most so many bytes of memory.
    pub fn read_within<T: DeserializeOwned, const MOST: usize>(
        self,
        bytes: &[u8],
    ) -> Result<T, String> {
        let read: Result<Erased<T>, String> = match self {
            Format::Json => serde_json::from_slice(bytes).map_err(|e| e.to_string()),
            Format::Cbor => ciborium::from_reader(bytes).map_err(|e| e.to_string()),
            Format::Bincode => {
                // Without a limit, a length in damaged bytes asks for as much memory. Not erased, since an error would
                // be quoted, and its length doubled, by each layer of what was read.
                let config = bincode::config::standard().with_limit::<MOST>();
                bincode::serde::decode_from_slice::<T, _>(bytes, config)
                    .map(|(value, _)| Erased(value))
                    .map_err(|e| e.to_string())
            }
            Format::Postcard => postcard::from_bytes(bytes).map_err(|e| e.to_string()),
        };
        read.map(|Erased(value)| value)
    }
}

/// A value of which the format does not know the type: else each type is compiled for each format, which takes a
/// quarter of the time to build these tests.
struct Erased<T>(T);

impl Serialize for Erased<&dyn erased_serde::Serialize> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        erased_serde::serialize(self.0, serializer)
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Erased<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut deserializer = <dyn erased_serde::Deserializer>::erase(deserializer);
        let value = erased_serde::deserialize(&mut deserializer);
        value.map(Erased).map_err(serde::de::Error::custom)
    }
}
