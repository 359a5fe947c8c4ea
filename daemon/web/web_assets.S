// The console's pages as part of the program (docs/console.md).
  .section .rodata
  .macro embed name, file
  .global skullstation_web_\name
  .global skullstation_web_\name\()_end
skullstation_web_\name:
  .incbin "\file"
skullstation_web_\name\()_end:
  .byte 0
  .endm

  embed page, index.html
  embed script, console.js
  embed style, console.css
  embed icon, icon.svg
  embed openapi, openapi.json
  .section .note.GNU-stack,"",%progbits
