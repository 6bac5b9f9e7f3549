"""Eight scenarios side by side: numbers of compiled code that fill a processor's vector."""
