"""The semantic judge: a vision-language model that scores rendered views of a layout."""
