//! Macro that declares an enum together with the text of each variant.

/// Declares an enum without data. `pub enum Name: first, second { Variant = "a", "b"; }` also
/// declares one method per text: `first()` returns "a", and `second()` returns "b".
///
/// Adds the constants `EACH`, every variant in order, and `WORDS`, the first text of each.
macro_rules! worded {
    (
        $(#[$meta:meta])*
        pub enum $name:ident: $($method:ident),+ {
            $($(#[$doc:meta])* $variant:ident = $word:literal $(, $more:literal)*;)*
        }
    ) => {
        $(#[$meta])*
        pub enum $name {
            $($(#[$doc])* $variant,)*
        }

        impl $name {
            /// Every variant, in the order of their declaration.
            #[doc(hidden)]
            pub const EACH: [Self; [$($word),*].len()] = [$(Self::$variant),*];

            /// Text of every variant, in the order of `EACH`; the first one if there are several.
            #[doc(hidden)]
            pub const WORDS: [&'static str; Self::EACH.len()] = [$($word),*];
        }

        worded!(@ $name [$($method)+] $({ $variant $word $($more)* })*);
    };
    (@ $name:ident [$method:ident $($others:ident)*] $({ $variant:ident $word:literal $($more:literal)* })*) => {
        impl $name {
            #[doc = concat!("Returns the `", stringify!($method), "` of the variant.")]
            #[doc(hidden)]
            pub const fn $method(self) -> &'static str {
                match self {
                    $(Self::$variant => $word,)*
                }
            }
        }

        worded!(@ $name [$($others)*] $({ $variant $($more)* })*);
    };
    (@ $name:ident [] $({ $variant:ident })*) => {};
}
