namespace freeflex {}
