// The default model as part of the program, see docs/models.md.
  .section .rodata
  .global skullstation_default_model
  .global skullstation_default_model_end
  .balign 16
skullstation_default_model:
  .incbin SKULLSTATION_DEFAULT_MODEL
skullstation_default_model_end:
  .byte 0
  .section .note.GNU-stack,"",%progbits
