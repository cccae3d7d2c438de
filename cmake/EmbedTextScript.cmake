file(READ ${INPUT} text)
file(WRITE ${OUTPUT} "#pragma once\n\nnamespace scan {\n\ninline constexpr char ${VARIABLE}[] = R\"__text__(${text})__text__\";\n\n}  // namespace scan\n")
