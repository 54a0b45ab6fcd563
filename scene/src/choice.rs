//! Choices: an object with one key, or just a name.
//!
//! Serde's derive reads them too, but its messages for an object with two keys, or for a name that
//! needs settings, are about serde's data model.

use std::fmt;
use std::marker::PhantomData;

use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, Error, IntoDeserializer, MapAccess, VariantAccess,
    Visitor,
};

/// Implements serde's traits by serde's derive (with `remote = "Self"`), with errors in terms of choices.
macro_rules! one_of {
    ($kind:ty, $what:literal) => {
        impl serde::Serialize for $kind {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                <$kind>::serialize(self, serializer)
            }
        }

        impl<'de> serde::Deserialize<'de> for $kind {
            fn deserialize<D: serde::Deserializer<'de>>(reader: D) -> Result<Self, D::Error> {
                struct Read;
                impl<'de> $crate::choice::Choice<'de> for Read {
                    type Value = $kind;
                    const WHAT: &'static str = $what;
                    fn read<D: serde::Deserializer<'de>>(reader: D) -> Result<$kind, D::Error> {
                        <$kind>::deserialize(reader)
                    }
                }
                $crate::choice::read::<Read, D>(reader)
            }
        }
    };
}

pub(crate) use one_of;

/// A way to read a choice.
pub(crate) trait Choice<'de> {
    /// The type of the choice.
    type Value;
    /// Its name in error messages.
    const WHAT: &'static str;
    /// Names in older files that no longer exist, and the names to write instead.
    const GONE: &'static [(&'static str, &'static str)] = &[];
    /// Reads the choice by serde's derive.
    fn read<D: Deserializer<'de>>(reader: D) -> Result<Self::Value, D::Error>;
}

/// Any type that derives serde's trait, for attributes `deserialize_with`.
pub(crate) struct Derived<T>(PhantomData<T>);

impl<'de, T: serde::Deserialize<'de>> Choice<'de> for Derived<T> {
    type Value = Option<T>;
    const WHAT: &'static str = "choice";
    fn read<D: Deserializer<'de>>(reader: D) -> Result<Option<T>, D::Error> {
        T::deserialize(reader).map(Some)
    }
}

/// Reads an optional choice, for `deserialize_with`.
pub(crate) fn optional<'de, T, D>(reader: D) -> Result<Option<T>, D::Error>
where
    T: serde::Deserialize<'de>,
    D: Deserializer<'de>,
{
    read::<Derived<T>, D>(reader)
}

pub(crate) fn read<'de, C: Choice<'de>, D: Deserializer<'de>>(
    reader: D,
) -> Result<C::Value, D::Error> {
    reader.deserialize_any(Outer::<C>(PhantomData))
}

struct Outer<C>(PhantomData<C>);

impl<'de, C: Choice<'de>> Visitor<'de> for Outer<C> {
    type Value = C::Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a {}: an object with one key, or a name", C::WHAT)
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<C::Value, E> {
        refuse_gone::<C, E>(name)?;
        C::read(Named {
            name,
            marker: PhantomData,
        })
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<C::Value, A::Error> {
        let Some(name) = map.next_key::<String>()? else {
            let message = format!("expected one {}, found an object without keys", C::WHAT);
            return Err(Error::custom(message));
        };
        refuse_gone::<C, _>(&name)?;
        let chosen = C::read(Keyed {
            name: &name,
            map: &mut map,
        })?;
        if let Some(other) = map.next_key::<String>()? {
            let what = C::WHAT;
            let message = format!("expected one {what}, found two: `{name}` and `{other}`");
            return Err(Error::custom(message));
        }
        Ok(chosen)
    }
}

fn refuse_gone<'de, C: Choice<'de>, E: Error>(name: &str) -> Result<(), E> {
    match C::GONE.iter().find(|(gone, _)| *gone == name) {
        Some((gone, now)) => Err(E::custom(format!(
            "the {} `{gone}` no longer exists: write \"{now}\" instead",
            C::WHAT
        ))),
        None => Ok(()),
    }
}

/// A choice that is a name alone.
struct Named<'a, E> {
    name: &'a str,
    marker: PhantomData<E>,
}

/// A choice that is a name with settings.
struct Keyed<'a, A> {
    name: &'a str,
    map: &'a mut A,
}

macro_rules! only_enums {
    () => {
        fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Self::Error> {
            Err(Error::custom("this is no choice"))
        }

        fn deserialize_enum<V: Visitor<'de>>(
            self,
            _: &'static str,
            _: &'static [&'static str],
            visitor: V,
        ) -> Result<V::Value, Self::Error> {
            visitor.visit_enum(self)
        }

        serde::forward_to_deserialize_any! {
            bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option
            unit unit_struct newtype_struct seq tuple tuple_struct map struct identifier ignored_any
        }
    };
}

impl<'de, E: Error> Deserializer<'de> for Named<'_, E> {
    type Error = E;
    only_enums!();
}

impl<'de, A: MapAccess<'de>> Deserializer<'de> for Keyed<'_, A> {
    type Error = A::Error;
    only_enums!();
}

impl<'de, 'a, E: Error> EnumAccess<'de> for Named<'a, E> {
    type Error = E;
    type Variant = Self;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Result<(V::Value, Self), E> {
        let name = seed.deserialize(self.name.into_deserializer())?;
        Ok((name, self))
    }
}

impl<E: Error> Named<'_, E> {
    fn needs_settings<T>(self) -> Result<T, E> {
        let name = self.name;
        let message = format!("`{name}` needs settings: expected {{ \"{name}\": … }}");
        Err(E::custom(message))
    }
}

impl<'de, E: Error> VariantAccess<'de> for Named<'_, E> {
    type Error = E;

    fn unit_variant(self) -> Result<(), E> {
        Ok(())
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, _: T) -> Result<T::Value, E> {
        self.needs_settings()
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, _: V) -> Result<V::Value, E> {
        self.needs_settings()
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        _: &'static [&'static str],
        _: V,
    ) -> Result<V::Value, E> {
        self.needs_settings()
    }
}

impl<'de, A: MapAccess<'de>> EnumAccess<'de> for Keyed<'_, A> {
    type Error = A::Error;
    type Variant = Self;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Result<(V::Value, Self), A::Error> {
        let name: serde::de::value::StrDeserializer<'_, A::Error> = self.name.into_deserializer();
        let name = seed.deserialize(name)?;
        Ok((name, self))
    }
}

/// Reads settings as the struct of these fields, or without them as a list.
struct Settings<V> {
    visitor: V,
    fields: Option<&'static [&'static str]>,
}

impl<'de, V: Visitor<'de>> DeserializeSeed<'de> for Settings<V> {
    type Value = V::Value;

    fn deserialize<D: Deserializer<'de>>(self, reader: D) -> Result<V::Value, D::Error> {
        match self.fields {
            Some(fields) => reader.deserialize_struct("settings", fields, self.visitor),
            None => reader.deserialize_seq(self.visitor),
        }
    }
}

impl<'de, A: MapAccess<'de>> VariantAccess<'de> for Keyed<'_, A> {
    type Error = A::Error;

    fn unit_variant(self) -> Result<(), A::Error> {
        let name = self.name;
        Err(Error::custom(format!(
            "`{name}` has no settings: expected just \"{name}\""
        )))
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, A::Error> {
        self.map.next_value_seed(seed)
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, A::Error> {
        self.map.next_value_seed(Settings {
            visitor,
            fields: None,
        })
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, A::Error> {
        self.map.next_value_seed(Settings {
            visitor,
            fields: Some(fields),
        })
    }
}
