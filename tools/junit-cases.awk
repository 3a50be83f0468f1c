# Converts ctest's JUnit report to one case per line: passed|failed|skipped TAB name TAB reason.
# Exits with 1 if the report has no case. -v prefix=TEXT is put before each name.
function attribute(name,   text) {
  text = $0
  if (!sub(".*[ \t]" name "=\"", "", text)) return ""
  sub("\".*", "", text)
  return unescape(text)
}
function unescape(text) {
  gsub(/&lt;/, "<", text); gsub(/&gt;/, ">", text); gsub(/&quot;/, "\"", text); gsub(/&amp;/, "\\&", text)
  return text
}
/^[ \t]*<testcase / {
  name = attribute("name"); status = attribute("status"); why = ""; reading = 0; marker = ""
  cases++
}
/^[ \t]*<skipped / { marker = attribute("message") }
# GoogleTest prints "FILE:LINE: Skipped", the message, then "[  SKIPPED ]"
reading && /^\[  SKIPPED \]/ { reading = 0 }
reading && $0 != "" { why = why (why == "" ? "" : " ") unescape($0) }
/: Skipped$/ { reading = 1 }
/^[ \t]*<\/testcase>/ {
  if (status == "run") outcome = "passed"
  else if (status == "disabled") { outcome = "skipped"; why = "disabled in the source" }
  else if (status == "notrun" && marker ~ /^SKIP_/) { outcome = "skipped"; if (why == "") why = "no reason given" }
  else outcome = "failed"
  printf "%s\t%s%s\t%s\n", outcome, prefix, name, why
}
END { exit cases == 0 }
